#pragma once

/// @file Heat: winding → housing → ambient, and the board with the power stage → ambient
/// (docs/model.md §6).

#include "model/plant/plant_params.hpp"

namespace lk::model {

template <class Real>
struct Temperatures {
  Real winding, housing, stage;  // °C
};

/// Heat into each node, W.
template <class Real>
struct Heat {
  Real winding, housing, stage;
};

/// °C. Limit of the housing: friction that heats it beyond has burnt it (assumed).
inline constexpr double kHottestHousing = 300.0;

inline namespace LKEMU_ISA {

/// One explicit Euler step; the fastest time constant is seconds, the period tens of microseconds.
template <class Real>
inline Temperatures<Real> thermal(const PlantParams<Real>& p, const Temperatures<Real>& t,
                                  const Heat<Real>& given) {
  const Real to_housing = (t.winding - t.housing) * p.g_winding_housing;
  const Real to_ambient = (t.housing - p.temp_ambient) * p.g_housing_ambient;
  const Real from_stage = (t.stage - p.temp_ambient) * p.g_stage_ambient;
  const Real housing = t.housing + (given.housing + to_housing - to_ambient) * p.heat_housing;
  return {t.winding + (given.winding - to_housing) * p.heat_winding,
          min(housing, Real(kHottestHousing)), t.stage + (given.stage - from_stage) * p.heat_stage};
}

}  // namespace LKEMU_ISA
}  // namespace lk::model
