#pragma once

/// @file Position and speed loops, once every few PWM periods (docs/internals/model.md §11).
/// Scalar code, because the loops are mostly branches. They use measurements, never the true state.

#include <cstdint>
#include <numbers>

#include "model/drive_params.hpp"
#include "model/setpoint.hpp"

namespace lk::model {

// Defined in model/control/current_loop.hpp, which is slow to compile.
template <class T>
struct CurrentOrders;

/// rad. A shaft within this angle of its target has arrived. The angle is two LSB (0.01°) of the
/// wire, less than one count of a 14-bit encoder.
inline constexpr double kHoldAngle = 0.02 * (2 * std::numbers::pi) / 360.0;

/// Physical gains and limits, derived again whenever a register changes.
struct MotionParams {
  double T_m = 1.0 / 8000;    // s, period of these loops
  double rad_per_count = 0;   // rotor rad per encoder count, signed by the encoder's direction
  double counts_per_rad = 0;  // 1 / rad_per_count
  double pole_pairs = 1;
  double angle_kp = 0, angle_ki = 0;  // 1/s, 1/s²
  double speed_kp = 0, speed_ki = 0;  // A·s/rad, A/rad
  double rad_s_per_count = 0;         // speed of one encoder count per period
  double estimator_share = 1;         // low-pass coefficient of the speed that the loops use
  int window_periods = 1;             // periods in a window of the reported speed
  int report_periods = 0;             // from the end of a window to its report, < window_periods
  double shown_per_count = 1;         // reply counts per encoder count, at most 1
  double rad_s_per_shown = 0;         // speed of one reply count per window
  double i_q_max = 0, omega_max = 0, accel_max = 0, current_step = 0;  // A, rad/s, rad/s², A/period
  double i_hardware = 0;  // A, range of the current sensor
  double modulation = 0;  // largest |v| / v_bus
  double power_max = 1;   // share of `modulation` for speed and position loops (voltage mode)
  bool has_current_loop = true;
  double R_s = 0, psi_f = 0;  // nominal, for the voltage mode
};

struct MotionState {
  double counts_before = 0, omega_hat = 0;    // counts, rad/s: estimator
  double shown_before = 0, omega_window = 0;  // counts of the reply, rad/s: last full window
  double omega_report = 0;                    // rad/s, reported speed
  int periods_in_window = 0;
  double speed_integral = 0;                // A
  double i_envelope = 0;                    // A, limit by the current ramp
  double angle_integral = 0;                // rad/s
  double theta_ref = 0, omega_profile = 0;  // rad, rad/s: state of the profile
  double omega_ref = 0;                     // rad/s, reference of the speed loop
  double i_q_ref = 0;                       // A
  double i_limit = 1e9;                     // A, limit of i_q_ref in force
  double lead = 0, lead_counts = 0;         // rad electrical since Lead began; counts at that time
};

MotionParams motion_params(const DriveParams& drive, const ControlSettings& settings);

/// Returns true if the current (without current sensors: the voltage) is above 0.8 (assumed) of its
/// limit in force.
bool near_limit(const MotionParams& p, const MotionState& s, double v_bus, double i_q, double v_q);

/// Returns the state of a shaft at rest with this encoder reading.
MotionState motion_state_at(const MotionParams& p, double encoder_counts);

/// Restarts the speed estimates at this encoder reading, so that its jump does not count as speed.
void accept_encoder_jump(const MotionParams& p, double encoder_counts, MotionState& s);

/// Runs one period: speed estimators, then the loops that the setpoint needs. `v_bus` [V] is the
/// measured voltage. Writes `orders` for the current loop; `Off` turns the bridge off.
void motion_loops(const MotionParams& p, const Setpoint& setpoint, double encoder_counts,
                  double v_bus, MotionState& s, CurrentOrders<double>& orders);

/// Call when a setpoint replaces another. References of a speed or position setpoint that `before`
/// did not use start from the state of the shaft.
void setpoint_changed(const MotionParams& p, const Setpoint& before, const Setpoint& after,
                      double encoder_counts, MotionState& s);

}  // namespace lk::model
