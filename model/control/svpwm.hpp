#pragma once

/// @file Space-vector PWM by min–max injection (docs/model.md §9).

#include "model/rounding.hpp"
#include "model/transforms.hpp"

namespace lk::model {
inline namespace LKEMU_ISA {

/// Returns the duties 0..1 of the three legs. The common mode −(max + min)/2 centres them, as in
/// the symmetric space-vector sequence (Zhou & Wang 2002). Linear up to |v| = v_bus/√3. Rounds to
/// the timer, then limits to duty_min..duty_max.
template <class Real>
inline Abc<Real> svpwm(const AlphaBeta<Real>& v, const Real& inv_v_bus, const Real& timer_counts,
                       const Real& timer_lsb, const Real& duty_max) {
  const Abc<Real> x = inverse_clarke(v);
  const Real centre = 0.5 * (max(max(x.a, x.b), x.c) + min(min(x.a, x.b), x.c));
  const auto leg = [&](const Real& v_x) {
    const Real duty = 0.5 + (v_x - centre) * inv_v_bus;
    return clamp(nearest(duty * timer_counts) * timer_lsb, 1.0 - duty_max, duty_max);
  };
  return {leg(x.a), leg(x.b), leg(x.c)};
}

}  // namespace LKEMU_ISA
}  // namespace lk::model
