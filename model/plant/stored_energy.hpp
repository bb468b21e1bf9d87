#pragma once

/// @file Energy stored in one drive's plant (docs/internals/model.md §8).

#include "model/plant/plant.hpp"

namespace lk::model {

/// Returns ½·C·v² + ¾·(L_d·i_d² + L_q·i_q²) + ½·J·ω² + gear spring + cogging and gravity
/// potentials, J.
inline double stored_energy(const PlantParams<double>& p, const PlantState<double>& s) {
  const double link = 0.5 * p.link_rate * p.T_s * s.v_link * s.v_link;
  const double magnetic = 0.75 * (p.L_d * s.i_d * s.i_d + p.L_q * s.i_q * s.i_q);
  const double kinetic =
      0.5 * p.T_s *
      (p.inertia_rate * s.omega * s.omega + p.inertia_rate_out * s.omega_out * s.omega_out);
  const double twist = s.theta * p.inv_gear - s.theta_out;
  const double excess = p.compliant * (twist - clamp(twist, -p.half_backlash, p.half_backlash));
  const double spring = 0.5 * p.gear_stiffness * excess * excess;
  double cogging = 0.0;
  if (p.cogging_per_turn != 0.0) {
    const double slots = p.cogging_per_turn * s.theta + p.cogging_phase;
    cogging -= (p.tau_cogging * sincos(slots).cos + p.tau_cogging_3 / 3 * sincos(3.0 * slots).cos) /
               p.cogging_per_turn;
  }
  if (p.pole_pairs != 0.0) {
    const SinCos<double> poles = sincos(2.0 * p.pole_pairs * s.theta);
    cogging -=
        (p.pole_cogging_cos * poles.cos - p.pole_cogging_sin * poles.sin) / (2.0 * p.pole_pairs);
  }
  return link + magnetic + kinetic + spring + cogging - p.tau_gravity * sincos(s.theta_out).cos;
}

}  // namespace lk::model
