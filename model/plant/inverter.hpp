#pragma once

/// @file Three half bridges, averaged over one PWM period (docs/internals/model.md §2).

#include "model/plant/plant_params.hpp"
#include "model/transforms.hpp"

namespace lk::model {

/// Effect of the bridge on the windings in one period, in dq of the mid-period rotor angle.
template <class Real>
struct InverterOutput {
  Dq<Real> duty;    // effective duty: link current = 3/2·(duty · i)
  Dq<Real> v_drop;  // V, lost in body diodes during the dead time
};

inline namespace LKEMU_ISA {

/// duty_eff,x = duty_x − (t_dead·f_pwm)·sat(i_x/i_zone). While both switches are off, the current
/// selects the diode: the leg spends the dead time at the wrong rail (Holmes & Lipo 2003, chapter
/// 1). Valid for |i| well above the ripple; inside ±i_zone, the error falls linearly to zero (soft
/// commutation, assumed). The Park transform is linear: duty and error are transformed separately.
template <class Real>
inline InverterOutput<Real> inverter(const PlantParams<Real>& p, const Abc<Real>& duty,
                                     const Abc<Real>& i, const SinCos<Real>& theta_e) {
  const auto sign = [&p](const Real& i_x) {
    return clamp(i_x * p.inv_i_dead_zone, Real(-1.0), Real(1.0));
  };
  const Abc<Real> s{sign(i.a), sign(i.b), sign(i.c)};
  const Dq<Real> direction = park(clarke(s), theta_e);
  const Dq<Real> wanted = park(clarke(duty), theta_e);
  return {{wanted.d - p.dead_fraction * direction.d, wanted.q - p.dead_fraction * direction.q},
          {p.dead_drop * direction.d, p.dead_drop * direction.q}};
}

}  // namespace LKEMU_ISA
}  // namespace lk::model
