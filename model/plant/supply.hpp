#pragma once

/// @file DC link fed by a source with resistance (docs/internals/model.md §5).

#include "model/plant/plant_params.hpp"

namespace lk::model {

template <class Real>
struct LinkStep {
  Real v_next;    // V
  Real i_source;  // A from the source, mean over the period
};

inline namespace LKEMU_ISA {

/// C·dv/dt = i_source − i_link, i_source = (v_source − v)/R ≥ −i_regen_max, i_link constant over T.
/// Exponential towards v_source − R·i_link, or linear while −i_regen_max limits the source.
template <class Real>
inline LinkStep<Real> link(const PlantParams<Real>& p, const Real& v, const Real& i_link) {
  const Real v_inf = p.v_source - p.R_source * i_link;
  const Real v_free = v_inf + (v - v_inf) * p.link_decay;
  const Real i_free = i_link + (v_free - v) * p.link_rate;
  const Real i_source = max(i_free, -p.i_regen_max);
  return {select(i_source > i_free, v + (i_source - i_link) * p.inv_link_rate, v_free), i_source};
}

/// Returns the largest mean current that can be drawn in a period without a link voltage below 0 V.
template <class Real>
inline Real emptying_current(const PlantParams<Real>& p, const Real& v) {
  const Real of_charge = v * p.link_rate;
  const Real beside_source = (p.v_source + v * p.link_decay / (1.0 - p.link_decay)) / p.R_source;
  const auto source_takes_too = v > p.v_source && p.i_regen_max != 0.0;
  return max(select(source_takes_too, min(of_charge, beside_source), of_charge), Real(0.0));
}

}  // namespace LKEMU_ISA
}  // namespace lk::model
