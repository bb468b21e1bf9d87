#pragma once

/// @file Position and speed loops, once every few PWM periods (docs/model.md §11). Scalar: they are
/// decisions more than arithmetic. They see measurements only.

#include <cstdint>
#include <numbers>

#include "model/drive_params.hpp"
#include "model/setpoint.hpp"

namespace lk::model {

// Of the fast tick, which is heavy (model/control/current_loop.hpp).
template <class T>
struct CurrentOrders;

/// rad. Closer than this to its target the shaft is there: two steps of the wire's 0.01°, less than
/// one count of a 14-bit encoder.
inline constexpr double kHoldAngle = 0.02 * (2 * std::numbers::pi) / 360.0;

/// Physical gains and limits; derived anew whenever a register changes.
struct MotionParams {
  double T_m = 1.0 / 8000;    // s, period of these loops
  double rad_per_count = 0;   // rotor rad per encoder count, signed by the encoder's direction
  double counts_per_rad = 0;  // its inverse
  double pole_pairs = 1;
  double angle_kp = 0, angle_ki = 0;  // 1/s, 1/s²
  double speed_kp = 0, speed_ki = 0;  // A·s/rad, A/rad
  double rad_s_per_count = 0;         // speed of one encoder count a period
  double estimator_share = 1;         // of the low-pass of the speed that the loops see
  int window_periods = 1;             // of the reported speed
  double shown_per_count = 1;         // counts of the reply an encoder count, at most 1
  double rad_s_per_shown = 0;         // speed of one such count a window
  double i_q_max = 0, omega_max = 0, accel_max = 0,
         current_step = 0;  // A, rad/s, rad/s², A per period
  double i_hardware = 0;    // A, what the current sensor can show
  double modulation = 0;    // largest |v| / v_bus
  double power_max = 1;     // share of it that the speed and position loops may use (voltage mode)
  bool has_current_loop = true;
  double R_s = 0, psi_f = 0;  // nominal, for the voltage mode
};

struct MotionState {
  double counts_before = 0, omega_hat = 0;    // counts, rad/s: estimator
  double shown_before = 0, omega_report = 0;  // counts of the reply, rad/s: reported speed
  int periods_in_window = 0;
  double speed_integral = 0;                // A
  double i_envelope = 0;                    // A, what the current ramp lets through
  double angle_integral = 0;                // rad/s
  double theta_ref = 0, omega_profile = 0;  // rad, rad/s: where the profile is now
  double omega_ref = 0;                     // rad/s, what the speed loop was told
  double i_q_ref = 0;                       // A
  double i_limit = 1e9;                     // A, in force for i_q_ref
  double lead = 0, lead_counts = 0;         // rad electrical since, and where, Lead began
};

MotionParams motion_params(const DriveParams& drive, const ControlSettings& settings);

/// The drive does about all it may: with more than 0.8 (assumed) of the limit in force, of
/// the current or, without current sensors, of the voltage.
bool near_limit(const MotionParams& p, const MotionState& s, double v_bus, double i_q, double v_q);

/// The estimator's start: at rest where the encoder stands.
MotionState motion_state_at(const MotionParams& p, double encoder_counts);

/// The encoder shows another angle, and there is no speed in it.
void encoder_leapt(const MotionParams& p, double encoder_counts, MotionState& s);

/// One period: observer, then the loops the setpoint asks for. `v_bus` as measured.
/// Writes the orders for the current loop; `Off` turns the bridge off.
void motion_loops(const MotionParams& p, const Setpoint& setpoint, double encoder_counts,
                  double v_bus, MotionState& s, CurrentOrders<double>& orders);

/// A new setpoint has replaced another: the references start from where the shaft is.
void setpoint_changed(const MotionParams& p, const Setpoint& before, const Setpoint& after,
                      double encoder_counts, MotionState& s);

}  // namespace lk::model
