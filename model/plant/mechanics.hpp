#pragma once

/// @file Rotor, gear, load and friction over one period (docs/internals/model.md §4).

#include "model/plant/plant_params.hpp"
#include "model/trig.hpp"

namespace lk::model {

template <class Real>
struct Motion {
  Real theta, omega;          // rad, rad/s: rotor
  Real theta_out, omega_out;  // rad, rad/s: output shaft
};

/// Result of one period: state of the shafts at its end, and mean powers, W.
template <class Real>
struct MechanicsStep {
  Motion<Real> next;
  Real p_friction, p_gear, p_load;
  Real p_iron;  // part of p_friction, in the stator's iron
};

inline namespace LKEMU_ISA {

/// Returns the friction torque on a body: `drive` [Nm], the friction that would stop the body
/// within this period, but at most `level`. A body at rest under a torque below `level` thus stays
/// exactly at rest.
template <class Real>
inline Real dry_friction(const Real& drive, const Real& level) {
  return clamp(drive, -level, level);
}

/// Torque at the output [Nm] of a gear with stiffness, damping and play, for the twist half a
/// period ahead. The teeth can push but not pull. `total` includes `damping`.
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

/// Returns sine and cosine of twice the electrical angle: one period per magnet pole.
template <class Real>
inline SinCos<Real> per_pole(const SinCos<Real>& theta_e) {
  return {2.0 * theta_e.sin * theta_e.cos, theta_e.cos * theta_e.cos - theta_e.sin * theta_e.sin};
}

/// Returns the cogging torque of slots and of magnet poles [Nm], with the angles half a period
/// ahead.
template <class Real>
inline Real cogging(const PlantParams<Real>& p, const Motion<Real>& m, const SinCos<Real>& pole) {
  const Real slots = p.cogging_per_turn * (m.theta + 0.5 * p.T_s * m.omega) + p.cogging_phase;
  const Real slot = sine<Real>(slots);
  // sin 3x = sin x·(3 − 4·sin² x)
  return slot * (p.tau_cogging + p.tau_cogging_3 * (3.0 - 4.0 * (slot * slot))) +
         (p.pole_cogging_cos * pole.sin + p.pole_cogging_sin * pole.cos);
}

/// Returns m·g·l·sin θ_out [Nm] of an arm at the output, with θ_out half a period ahead.
template <class Real>
inline Real gravity(const PlantParams<Real>& p, const Motion<Real>& m) {
  return p.tau_gravity * sine<Real>(m.theta_out + 0.5 * p.T_s * m.omega_out);
}

/// Applies hard, inelastic end stops at the output: a shaft that was at `before` moves no further
/// out. A shaft already beyond a new stop may move back, but is not put back. Returns the mean
/// power lost in the impact, W: kinetic energy minus the energy stored by putting the shaft back on
/// the stop. `holding` is the torque of spring and gravity on the output [Nm].
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

/// Optional parts of the tick, chosen at compile time. If no drive needs a part, the results
/// without the part have the same bits.
struct Parts {
  bool bridge_off;  // needed if a bridge is off: diodes conduct
  bool compliant;   // needed if a gear has stiffness and play
  bool end_stops;   // needed if an output shaft has end stops
  bool faults;      // needed if a drive has faults of lane_faults.hpp
};
inline constexpr Parts kFaultyParts{true, true, true, true};
inline constexpr Parts kEveryPart{true, true, true, false};
inline constexpr Parts kCommonParts{false, false, false, false};

/// J·(ω₁ − ω₀)/T = τ − B·(ω₀ + ω₁)/2 − τ_dry,  θ₁ = θ₀ + T·(ω₀ + ω₁)/2,
/// with forces at the middle of the period: position Verlet with implicit friction, second order.
/// Stribeck: τ_dry ≤ τ_c + (τ_s − τ_c)/(1 + (ω/ω_s)²), the rational form that needs no exponential.
/// The gear loses (1 − η) of the torque it transmits, as friction on the rotor, in either direction
/// of power flow. At rest, the direction of the torque decides. The rotor's speed is clamped to
/// ω_max, beyond which the equations are not valid. `pole` is per_pole() of half a period ahead.
template <Parts parts = kEveryPart, class Real>
inline MechanicsStep<Real> mechanics(const PlantParams<Real>& p, const Motion<Real>& m,
                                     const Real& tau_e, const SinCos<Real>& pole) {
  const auto compliant = p.compliant != 0.0;
  ToothTorque<Real> tooth{0.0, 0.0};
  if constexpr (parts.compliant) {
    tooth = tooth_torque(p, m);
  }
  const Real tau_gravity = gravity(p, m);
  const Real tau_world = p.tau_load - tau_gravity;

  // Torque that the gear transmits, at the output.
  const Real transmitted = select_if<parts.compliant>(compliant, tooth.total, Real(-tau_world));
  const Real bearing =
      p.tau_coulomb + p.tau_static_excess / (1.0 + m.omega * m.omega * p.inv_omega_stribeck2);
  const Real tau = tau_e - cogging(p, m, pole) - transmitted * p.inv_gear;

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
