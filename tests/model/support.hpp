#pragma once

/// @file Shared helpers of model tests: an ideal drive with single disturbances, and the plant
/// alone.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "model/drive_bank.hpp"
#include "model/tick.hpp"

namespace lk::model::test {

inline constexpr double kPiT = std::numbers::pi;

/// An ideal direct drive: no friction, noise or dead time, no temperature coefficients, a stiff
/// source, fine sensors. Tests add the effects under test.
inline DriveParams ideal_drive() {
  DriveParams d;
  d.motor.alpha_cu = 0.0;
  d.motor.alpha_pm = 0.0;
  d.inverter.t_dead = 0.0;
  d.inverter.R_on = 0.0;
  d.inverter.timer_counts = 1e6;
  d.supply.R_source = 1e-3;
  d.supply.C_link = 1e-3;
  d.encoder.bits = 18;
  d.encoder.latency = 0.0;
  d.current_sensor.noise = 0.0;
  d.current_sensor.bits = 20;
  d.slow_sensor.v_noise = 0.0;
  d.slow_sensor.v_lsb = 1e-4;
  return d;
}

/// Settings without limits.
inline ControlSettings unlimited() {
  ControlSettings s;
  s.i_q_max = 1e3;
  s.omega_max = 1e4;
  return s;
}

/// As `unlimited()`, with one protection.
inline ControlSettings protecting(Error error, const Protection& protection) {
  ControlSettings s = unlimited();
  s.protections[static_cast<std::size_t>(error)] = protection;
  return s;
}

/// An ideal drive with a rigid gear of 10.
inline DriveParams geared() {
  DriveParams d = ideal_drive();
  d.mechanics.J = 140e-7;
  d.mechanics.gear_ratio = 10.0;
  return d;
}

/// Energy lost, delivered or stored, J.
inline double spent(const EnergyLedger& e) {
  return e.copper + e.inverter + e.friction + e.gear + e.load + e.stored;
}
/// Energy supplied since `start` minus the energy spent since then, J: 0 if the ledger closes.
inline double residual(const EnergyLedger& now, const EnergyLedger& start) {
  return (now.supply - start.supply) - (spent(now) - spent(start));
}

/// Converts from the frame of a rotor at `theta_e`, rad electrical.
inline Abc<double> phases(const Dq<double>& x, double theta_e) {
  return inverse_clarke(inverse_park(x, sincos(theta_e)));
}

inline double k_t(const MotorParams& m) { return 1.5 * m.pole_pairs * m.psi_f; }

/// The plant without firmware.
struct BarePlant {
  PlantParams<double> p;
  PlantState<double> s;

  explicit BarePlant(const DriveParams& d) : p(plant_params(d)) {
    s.v_link = d.supply.v_source;
    s.temp_winding = s.temp_housing = s.temp_stage = d.thermal.temp_ambient;
  }
  /// Steps one period with duties of the stator's legs.
  void step(const Abc<double>& duty, bool bridge_on = true) {
    const SinCos<double> theta_e = sincos<double>(p.pole_pairs * s.theta);
    const Abc<double> i = phases({s.i_d, s.i_q}, p.pole_pairs * s.theta);
    lk::model::advance(p, s, duty, bridge_on ? 1.0 : 0.0, i, theta_e);
  }
  /// Steps one period with a voltage [V] in the rotor's frame at the period's middle.
  void step_dq(const Dq<double>& v) { step(duty_of(v, s.omega)); }
  /// Returns the duties that give this voltage at the middle of a period with speed `omega`.
  Abc<double> duty_of(const Dq<double>& v, double omega) const {
    const Abc<double> x = phases(v, p.pole_pairs * (s.theta + 0.5 * p.T_s * omega));
    return {0.5 + x.a / s.v_link, 0.5 + x.b / s.v_link, 0.5 + x.c / s.v_link};
  }
  void free_step() { step({0.5, 0.5, 0.5}, false); }
  /// Returns the rounded number of periods in `seconds`.
  int periods(double seconds) const { return static_cast<int>(std::lround(seconds * p.f_s)); }
  double supplied() const { return s.p_supply * p.T_s; }    // J
  double copper() const { return s.p_copper * p.T_s; }      // J
  double inverter() const { return s.p_inverter * p.T_s; }  // J
  double energy() const {  // J, as in the ledger, for a direct drive without springs
    return 0.5 * p.link_rate * p.T_s * s.v_link * s.v_link +
           0.75 * (p.L_d * s.i_d * s.i_d + p.L_q * s.i_q * s.i_q) +
           0.5 * p.T_s * p.inertia_rate * s.omega * s.omega;
  }
};

/// The shafts alone, with a torque at the rotor.
struct Shafts {
  PlantParams<double> p;
  Motion<double> m{};
  double friction = 0, gear = 0, load = 0;  // J

  explicit Shafts(const DriveParams& d) : p(plant_params(d)) {}
  void step(double tau_e) {
    const double ahead = 0.5 * p.T_s * m.omega;
    const MechanicsStep<double> s =
        mechanics(p, m, tau_e, per_pole(sincos(p.pole_pairs * (m.theta + ahead))));
    m = s.next;
    friction += s.p_friction * p.T_s;
    gear += s.p_gear * p.T_s;
    load += s.p_load * p.T_s;
  }
  void run(double seconds, double tau_e) {
    for (long n = std::lround(seconds * p.f_s); n > 0; --n) {
      step(tau_e);
    }
  }
};

/// Returns the mean time between the moments at which `value(shafts)` falls through 0, s.
template <class Value>
double period_of(Shafts& shafts, double seconds, Value value) {
  int crossings = 0;
  double first = 0, last = 0;
  double before = value(shafts);
  for (int n = 1; n <= std::lround(seconds * shafts.p.f_s); ++n) {
    shafts.step(0.0);
    const double now = value(shafts);
    if (before > 0.0 && now <= 0.0) {
      (crossings == 0 ? first : last) = n * shafts.p.T_s;
      ++crossings;
    }
    before = now;
  }
  return (last - first) / (crossings - 1);
}

/// A bank with one drive.
inline DriveBank one_drive(const DriveParams& params, const ControlSettings& settings = unlimited(),
                           double theta_m = 0.0, std::uint64_t seed = 1) {
  const DriveInit init{params, settings, seed, theta_m};
  return DriveBank({&init, 1});
}

inline std::int64_t ticks_in(const DriveParams& d, double seconds) {
  return std::llround(seconds * d.inverter.f_pwm);
}

}  // namespace lk::model::test
