#pragma once

/// @file Rotor, gear, load and friction over one period (docs/model.md §4).

#include "model/plant/plant_params.hpp"
#include "model/trig.hpp"

namespace lk::model {

template <class Real>
struct Motion {
  Real theta, omega;          // rad, rad/s: rotor
  Real theta_out, omega_out;  // rad, rad/s: output shaft
};

/// The shafts' period: where they are at its end, and where the power went (means, W).
template <class Real>
struct MechanicsStep {
  Motion<Real> next;
  Real p_friction, p_gear, p_load;
  Real p_iron;  // of p_friction, what arises in the stator's iron
};

inline namespace LKEMU_ISA {

/// Torque that friction takes from a body whose momentum per period would be `drive` [Nm]: as much
/// as it needs to stop it, at most `level`. So a body at rest under less than `level` stays exactly
/// there.
template <class Real>
inline Real dry_friction(const Real& drive, const Real& level) {
  return clamp(drive, -level, level);
}

/// Gear with stiffness, damping and play: torque at the output [Nm] for the twist half a period
/// ahead. The teeth push, they never pull. Split into the spring's part and what damping takes.
template <class Real>
struct ToothTorque {
  Real total, damping;
};

template <class Real>
inline ToothTorque<Real> tooth_torque(const PlantParams<Real>& p, const Motion<Real>& m) {
  const Real rate = m.omega * p.inv_gear - m.omega_out;
  const Real twist = m.theta * p.inv_gear - m.theta_out + 0.5 * p.T_s * rate;
  const Real excess = twist - clamp(twist, -p.half_backlash, p.half_backlash);
  const Real spring = p.gear_stiffness * excess;
  const Real free = spring + p.gear_damping * rate;
  const Real total = select(excess > 0.0, max(free, Real(0.0)),
                            select(excess < 0.0, min(free, Real(0.0)), Real(0.0)));
  return {total, total - spring};
}

/// τ_cog·sin(n·θ) at θ half a period ahead.
template <class Real>
inline Real cogging(const PlantParams<Real>& p, const Motion<Real>& m) {
  return p.tau_cogging * sine<Real>(p.cogging_per_turn * (m.theta + 0.5 * p.T_s * m.omega));
}

/// m·g·l·sin θ_out of an arm at the output, half a period ahead.
template <class Real>
inline Real gravity(const PlantParams<Real>& p, const Motion<Real>& m) {
  return p.tau_gravity * sine<Real>(m.theta_out + 0.5 * p.T_s * m.omega_out);
}

/// Hard, inelastic end stops at the output: a shaft that was `before` gets no further out. One that
/// found itself beyond when the stops were put there may come back, and is not thrown. Gives what
/// the impact destroys, as a mean over the period, W: kinetic energy, less what taking the shaft
/// back to the stop stores against `holding`, the spring's and gravity's torque on the output.
template <class Real>
inline Real stop_at_ends(const PlantParams<Real>& p, const Real& before, const Real& holding,
                         Motion<Real>& m) {
  const auto hit = (m.theta_out < p.theta_min && m.omega_out < 0.0) ||
                   (m.theta_out > p.theta_max && m.omega_out > 0.0);
  if (!any(hit)) {
    return Real(0.0);
  }
  const auto rotor_too = hit && p.compliant == 0.0;
  const Real held = clamp(m.theta_out, min(p.theta_min, before), max(p.theta_max, before));
  const Real back = select(hit, (m.theta_out - held) * p.f_s, Real(0.0));
  const Real destroyed =
      select(hit, 0.5 * p.inertia_rate_out * m.omega_out * m.omega_out, Real(0.0)) +
      select(rotor_too, 0.5 * p.inertia_rate * m.omega * m.omega, Real(0.0)) - holding * back;
  m.theta_out = select(hit, held, m.theta_out);
  m.omega_out = select(hit, Real(0.0), m.omega_out);
  m.theta = select(rotor_too, m.theta_out * p.gear_ratio, m.theta);
  m.omega = select(rotor_too, Real(0.0), m.omega);
  return destroyed;
}

/// Which of the seldom needed parts a tick is built with. A part that is left out would have
/// changed no bit of the drives it is left out for.
struct Parts {
  bool bridge_off;  // some bridge is off: diodes conduct
  bool compliant;   // some gear has stiffness and play
  bool end_stops;   // some output shaft has them
  bool faults;      // of some drive are such as the tick has to know (lane_faults.hpp)
};
inline constexpr Parts kFaultyParts{true, true, true, true};
inline constexpr Parts kEveryPart{true, true, true, false};
inline constexpr Parts kCommonParts{false, false, false, false};

/// J·(ω₁ − ω₀)/T = τ − B·(ω₀ + ω₁)/2 − τ_dry,  θ₁ = θ₀ + T·(ω₀ + ω₁)/2,
/// forces taken at the middle of the period: position Verlet with implicit friction, second order.
/// Stribeck: τ_dry ≤ τ_c + (τ_s − τ_c)/(1 + (ω/ω_s)²), the rational form that needs no exponential.
/// The gear loses (1 − η) of the torque it transmits, as friction on the rotor, in either
/// direction; at rest in that in which the rotor is pushed. At ω_max the rotor is held, whatever
/// pushes: beyond it the equations hold no more.
template <Parts parts = kEveryPart, class Real>
inline MechanicsStep<Real> mechanics(const PlantParams<Real>& p, const Motion<Real>& m,
                                     const Real& tau_e) {
  const auto compliant = p.compliant != 0.0;
  ToothTorque<Real> tooth{0.0, 0.0};
  if constexpr (parts.compliant) {
    tooth = tooth_torque(p, m);
  }
  const Real tau_gravity = gravity(p, m);
  const Real tau_world = p.tau_load - tau_gravity;

  // What the output asks of the rotor's side of the gear.
  const Real transmitted = select_if<parts.compliant>(compliant, tooth.total, Real(-tau_world));
  const Real bearing =
      p.tau_coulomb + p.tau_static_excess / (1.0 + m.omega * m.omega * p.inv_omega_stribeck2);
  const Real tau = tau_e - cogging(p, m) - transmitted * p.inv_gear;

  const Real drive = (p.inertia_rate - p.B_half) * m.omega + tau;
  const Real heading = select(m.omega == 0.0, drive, m.omega);
  const Real tooth_loss = select(transmitted * heading > 0.0, p.loss_driving, p.loss_driven);
  const Real tau_dry = dry_friction<Real>(drive, bearing + tooth_loss * abs(transmitted));

  MechanicsStep<Real> step;
  Motion<Real>& next = step.next;
  next.omega = clamp((drive - tau_dry) * p.mobility, -p.omega_max, p.omega_max);
  const Real omega_mean = 0.5 * (m.omega + next.omega);
  next.theta = m.theta + p.T_s * omega_mean;

  const Real drive_out = p.inertia_rate_out * m.omega_out + tooth.total + tau_world;
  const Real tau_dry_out = dry_friction(drive_out, p.tau_coulomb_out);
  next.omega_out = select_if<parts.compliant>(
      compliant, Real((drive_out - tau_dry_out) * p.mobility_out), Real(next.omega * p.inv_gear));
  const Real omega_out_mean = 0.5 * (m.omega_out + next.omega_out);
  next.theta_out = select_if<parts.compliant>(compliant, Real(m.theta_out + p.T_s * omega_out_mean),
                                              Real(next.theta * p.inv_gear));

  const Real bearing_share = dry_friction(tau_dry, bearing);
  const Real out_share =
      select_if<parts.compliant>(compliant, Real(tau_dry_out * omega_out_mean), Real(0.0));
  step.p_friction = (bearing_share + 2.0 * p.B_half * omega_mean) * omega_mean + out_share;
  step.p_iron =
      (dry_friction(bearing_share, p.tau_hysteresis) + p.B_eddy * omega_mean) * omega_mean;
  step.p_gear = (tau_dry - bearing_share) * omega_mean;
  if constexpr (parts.compliant) {
    step.p_gear += tooth.damping * (omega_mean * p.inv_gear - omega_out_mean);
  }
  step.p_load = -p.tau_load * omega_out_mean;
  if constexpr (parts.end_stops) {
    const Real spring = select(compliant, tooth.total - tooth.damping, Real(0.0));
    step.p_friction += stop_at_ends<Real>(p, m.theta_out, spring - tau_gravity, next);
  }
  return step;
}

}  // namespace LKEMU_ISA
}  // namespace lk::model
