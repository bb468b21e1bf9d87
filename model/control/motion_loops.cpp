#include "model/control/motion_loops.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "model/control/current_loop.hpp"
#include "model/control/current_loop_params.hpp"
#include "model/rounding.hpp"
#include "model/trig.hpp"

namespace lk::model {
namespace {

/// The angle integrator acts only within this distance of the target.
constexpr double kTrimAngle = 0.02;  // rad, assumed
/// Bits of the encoder field in replies. Assumed: drives compute the reported speed from it. A real
/// drive at rest reports speeds in steps of about 5 °/s (360°/65536 a ms).
constexpr int kShownBits = 16;
/// Below this speed, the sign of the speed estimate is noise, so no current counts as braking.
constexpr double kRampSpeed = 0.5;  // rad/s, assumed

/// Estimates the speed from the counts (docs/internals/model.md §11). The loops get the difference
/// of two readings, low-passed. The replies get the distance within the last window, in whole
/// counts of the reply, `report_periods` after the end of the window.
void observe(const MotionParams& p, double encoder_counts, MotionState& s) {
  const double difference = (encoder_counts - s.counts_before) * p.rad_s_per_count;
  s.omega_hat += p.estimator_share * (difference - s.omega_hat);
  s.counts_before = encoder_counts;
  if (++s.periods_in_window >= p.window_periods) {
    const double shown = floored(encoder_counts * p.shown_per_count);
    s.omega_window = (shown - s.shown_before) * p.rad_s_per_shown;
    s.shown_before = shown;
    s.periods_in_window = 0;
  }
  if (s.periods_in_window == p.report_periods) s.omega_report = s.omega_window;
}

/// Shares of the current limit and, in voltage mode, of the voltage limit that Lead uses (assumed).
/// They suffice for friction and cogging, and heat a jammed motor only slowly.
constexpr double kLeadCurrent = 0.5, kLeadVoltage = 0.25;

double limit(double x, double most) { return std::clamp(x, -most, most); }

/// Range of the speed loop's output, A.
struct CurrentRange {
  double low, high;
};

/// Returns ±i_max; in voltage mode also limited by (±v_max − back-EMF)/R.
CurrentRange current_range(const MotionParams& p, double i_max, double v_bus,
                           const MotionState& s) {
  if (p.has_current_loop) {
    return {-i_max, i_max};
  }
  const double v_max = p.power_max * p.modulation * v_bus;
  const double emf = p.pole_pairs * s.omega_hat * p.psi_f;
  return {std::clamp((-v_max - emf) / p.R_s, -i_max, i_max),
          std::clamp((v_max - emf) / p.R_s, -i_max, i_max)};
}

/// Speed PI controller with conditional integration: the integrator does not grow further into a
/// limit. With a gain of 0, the integrator is 0.
double speed_loop(const MotionParams& p, double omega_ref, const CurrentRange& range,
                  MotionState& s) {
  s.omega_ref = omega_ref;
  if (p.speed_ki == 0.0) {
    s.speed_integral = 0.0;
  }
  const double error = omega_ref - s.omega_hat;
  const double wanted = p.speed_kp * error + s.speed_integral;
  const double given = std::clamp(wanted, range.low, range.high);
  if (wanted == given || (wanted - given) * error < 0.0) {
    s.speed_integral =
        std::clamp(s.speed_integral + p.speed_ki * p.T_m * error, range.low, range.high);
  }
  return given;
}

/// Returns the largest speed from which the shaft can stop within `distance` at `accel`. This is
/// the discrete form of √(2·a·d), so that the profile ends exactly on its target.
double stopping_speed(double distance, double accel, double T) {
  const double steps = std::sqrt(0.25 + 2.0 * distance / (accel * T * T)) - 0.5;
  return std::min(accel * T * steps, distance / T);
}

/// Advances the trapezoidal speed profile towards `target` by one period, with at most accel_max
/// and `omega_max`.
void trapezoid(const MotionParams& p, double target, double omega_max, MotionState& s) {
  const double distance = target - s.theta_ref;
  const double allowed =
      std::min(omega_max, stopping_speed(std::abs(distance), p.accel_max, p.T_m));
  const double step = p.accel_max * p.T_m;
  s.omega_profile =
      std::clamp(std::copysign(allowed, distance), s.omega_profile - step, s.omega_profile + step);
  s.theta_ref += s.omega_profile * p.T_m;
}

/// Angle integrator: acts only near the target and restarts when the error changes sign. Its output
/// is at most `omega_max`. With a gain of 0, the integrator is 0.
void trim(const MotionParams& p, double error, double omega_max, MotionState& s) {
  const bool other_side = error * s.angle_integral < 0.0;
  if (p.angle_ki == 0.0 || error == 0.0 || other_side || std::abs(error) > kTrimAngle) {
    s.angle_integral = 0.0;
  } else {
    s.angle_integral = limit(s.angle_integral + p.angle_ki * p.T_m * error, omega_max);
  }
}

double position_loop(const MotionParams& p, const Position& setpoint, double encoder_counts,
                     double v_bus, MotionState& s) {
  const double omega_max =
      setpoint.omega_max > 0.0 ? std::min(setpoint.omega_max, p.omega_max) : p.omega_max;
  if (p.accel_max > 0.0) {
    trapezoid(p, setpoint.theta, omega_max, s);
  } else {
    s.theta_ref = setpoint.theta;
    s.omega_profile = 0.0;
  }
  // The error is in whole counts, and 0 if it is at most kHoldAngle.
  const double error_counts = nearest(s.theta_ref * p.counts_per_rad) - encoder_counts;
  const double distance = error_counts * p.rad_per_count;
  const double error = std::abs(distance) > kHoldAngle ? distance : 0.0;
  trim(p, error, omega_max, s);
  // While the profile slows down to a lower `omega_max`, the limit is the profile's speed.
  const double omega_most = std::max(omega_max, std::abs(s.omega_profile));
  const double omega_ref =
      limit(s.omega_profile + p.angle_kp * error + s.angle_integral, omega_most);
  return speed_loop(p, omega_ref, current_range(p, p.i_q_max, v_bus, s), s);
}

double speed_setpoint(const MotionParams& p, const Speed& setpoint, double v_bus, MotionState& s) {
  const double i_max = setpoint.i_q_max > 0.0 ? std::min(setpoint.i_q_max, p.i_q_max) : p.i_q_max;
  s.i_limit = i_max;
  double omega_ref = setpoint.omega;
  if (p.accel_max > 0.0) {
    const double step = p.accel_max * p.T_m;
    omega_ref = std::clamp(setpoint.omega, s.omega_ref - step, s.omega_ref + step);
  }
  return speed_loop(p, omega_ref, current_range(p, i_max, v_bus, s), s);
}

bool follows(const Setpoint& setpoint) {
  return std::holds_alternative<Speed>(setpoint) || std::holds_alternative<Position>(setpoint);
}

/// Returns the rotor angle minus the angle of the dq frame, rad electrical. Starts with a quarter
/// turn, at which the current causes no torque and holds the rotor.
double lead_behind(const MotionParams& p, const Lead& setpoint, double encoder_counts,
                   MotionState& s) {
  s.lead += setpoint.omega_e * p.T_m;
  const double turned = p.pole_pairs * (encoder_counts - s.lead_counts) * p.rad_per_count;
  return turned - s.lead + 0.5 * std::numbers::pi;
}

/// Returns the current reference of the setpoint, before the current ramp, A.
double wanted_current(const MotionParams& p, const Setpoint& setpoint, double encoder_counts,
                      double v_bus, MotionState& s) {
  s.i_limit = p.i_q_max;
  if (const auto* torque = std::get_if<Torque>(&setpoint)) {
    return limit(torque->i_q, p.i_hardware);
  }
  if (std::holds_alternative<Lead>(setpoint)) {
    return kLeadCurrent * std::min(p.i_q_max, p.i_hardware);
  }
  if (const auto* speed = std::get_if<Speed>(&setpoint)) {
    return speed_setpoint(p, *speed, v_bus, s);
  }
  if (const auto* position = std::get_if<Position>(&setpoint)) {
    return position_loop(p, *position, encoder_counts, v_bus, s);
  }
  return 0.0;
}

/// Current ramp: limits the current of the speed loop to an envelope while the current accelerates
/// the shaft. The envelope grows by the ramp while it limits the current. Else it shrinks, fifty
/// times slower (assumed), so that noise is not rectified. Braking currents are not limited, to
/// keep the loop's damping, but the envelope follows them: they may have to hold a load at rest.
/// The integrator stays inside the envelope.
double soft_start(const MotionParams& p, double wanted, MotionState& s) {
  const bool brakes = wanted * s.omega_hat < 0.0 && std::abs(s.omega_hat) > kRampSpeed;
  if (p.current_step <= 0.0) {
    return wanted;
  }
  if (brakes) {
    s.i_envelope = std::max(s.i_envelope, std::abs(wanted));
    return wanted;
  }
  const bool in_the_way = std::abs(wanted) > s.i_envelope;
  s.i_envelope =
      std::max(0.0, s.i_envelope + (in_the_way ? p.current_step : -0.02 * p.current_step));
  s.speed_integral = limit(s.speed_integral, s.i_envelope);
  return limit(wanted, s.i_envelope);
}

/// Returns v_q [V] for a drive without current sensors: R·i_q + ω·ψ for the loops.
double voltage_for(const MotionParams& p, const Setpoint& setpoint, double v_bus,
                   const MotionState& s) {
  if (const auto* open_loop = std::get_if<OpenLoop>(&setpoint)) {
    return limit(open_loop->power, 1.0) * p.modulation * v_bus;
  }
  if (std::holds_alternative<Lead>(setpoint)) {
    return kLeadVoltage * p.power_max * p.modulation * v_bus;
  }
  return p.R_s * s.i_q_ref + p.pole_pairs * s.omega_hat * p.psi_f;
}

}  // namespace

MotionParams motion_params(const DriveParams& drive, const ControlSettings& settings) {
  const ControlParams& c = drive.control;
  const GainBytes& bytes = settings.gains;
  const double k_t = 1.5 * drive.motor.pole_pairs * drive.motor.psi_f;
  const double kp_at_reference = c.speed_bandwidth * c.J_nominal / k_t;
  MotionParams p;
  p.T_m = c.motion_divider / drive.inverter.f_pwm;
  p.rad_per_count = drive.encoder.direction * kTwoPi / static_cast<double>(1 << drive.encoder.bits);
  p.counts_per_rad = 1.0 / p.rad_per_count;
  p.pole_pairs = drive.motor.pole_pairs;
  p.angle_kp = c.angle_kp_per_byte * bytes.angle_kp;
  p.angle_ki = c.angle_ki_per_byte * bytes.angle_ki;
  p.speed_kp = kp_at_reference * bytes.speed_kp / c.ref_speed_kp_byte;
  p.speed_ki = kp_at_reference * c.speed_integral_rate * bytes.speed_ki / c.ref_speed_ki_byte;
  p.rad_s_per_count = p.rad_per_count / p.T_m;
  p.estimator_share = c.estimator_bandwidth * p.T_m / (1.0 + c.estimator_bandwidth * p.T_m);
  p.window_periods = static_cast<int>(std::max(1.0, nearest(1.0 / (c.report_bandwidth * p.T_m))));
  p.report_periods =
      std::min(static_cast<int>(nearest(c.report_delay / p.T_m)), p.window_periods - 1);
  p.shown_per_count = 1.0 / static_cast<double>(1 << std::max(drive.encoder.bits - kShownBits, 0));
  p.rad_s_per_shown = p.rad_s_per_count / (p.shown_per_count * p.window_periods);
  p.i_q_max = settings.i_q_max;
  p.omega_max = settings.omega_max;
  p.accel_max = settings.accel_max;
  p.current_step = settings.current_ramp * p.T_m;
  p.i_hardware = drive.current_sensor.range;
  p.modulation = modulation(drive.inverter);
  p.power_max = settings.power_max;
  p.has_current_loop = c.has_current_loop;
  p.R_s = drive.motor.R_s;
  p.psi_f = drive.motor.psi_f;
  return p;
}

bool near_limit(const MotionParams& p, const MotionState& s, double v_bus, double i_q, double v_q) {
  constexpr double kMax = 0.8;
  constexpr double kNothing = 1e-3;  // A, assumed: with a smaller limit, no current is near it
  if (p.has_current_loop) {
    return s.i_limit > kNothing && std::abs(i_q) > kMax * s.i_limit;
  }
  return std::abs(v_q) > kMax * p.power_max * p.modulation * v_bus;
}

MotionState motion_state_at(const MotionParams& p, double encoder_counts) {
  MotionState s;
  accept_encoder_jump(p, encoder_counts, s);
  return s;
}

void accept_encoder_jump(const MotionParams& p, double encoder_counts, MotionState& s) {
  s.counts_before = encoder_counts;
  s.shown_before = floored(encoder_counts * p.shown_per_count);
}

void setpoint_changed(const MotionParams& p, const Setpoint& before, const Setpoint& after,
                      double encoder_counts, MotionState& s) {
  if (!std::holds_alternative<Lead>(before)) {
    s.lead = 0.0;
    s.lead_counts = encoder_counts;
  }
  if (!follows(after)) {
    s.speed_integral = 0.0;
    s.omega_ref = 0.0;
    return;
  }
  if (!follows(before)) {
    s.speed_integral = 0.0;
    s.i_envelope = 0.0;
    s.omega_ref = s.omega_hat;
  }
  if (!std::holds_alternative<Position>(before)) {
    s.omega_profile = s.omega_ref;
    s.theta_ref = encoder_counts * p.rad_per_count;
    s.angle_integral = 0.0;
  }
}

void motion_loops(const MotionParams& p, const Setpoint& setpoint, double encoder_counts,
                  double v_bus, MotionState& s, CurrentOrders<double>& orders) {
  observe(p, encoder_counts, s);
  const double wanted = wanted_current(p, setpoint, encoder_counts, v_bus, s);
  s.i_q_ref = follows(setpoint) ? soft_start(p, wanted, s) : wanted;

  orders.i_q_ref = s.i_q_ref;
  orders.v_q_ref = p.has_current_loop ? 0.0 : voltage_for(p, setpoint, v_bus, s);
  orders.omega_e = p.pole_pairs * s.omega_hat;
  orders.v_bus = v_bus;
  const auto* lead = std::get_if<Lead>(&setpoint);
  orders.behind_e = lead != nullptr ? lead_behind(p, *lead, encoder_counts, s) : 0.0;
  orders.bridge_on = std::holds_alternative<Off>(setpoint) ? 0.0 : 1.0;
}

}  // namespace lk::model
