#pragma once

#include <array>
#include <cstdint>
#include <variant>

namespace lk::model {

// Setpoints from the host. Positions are rotor angles in the frame of encoder_position: 0 rad is
// encoder count 0 of the turn in which the drive powered up.
struct Off {};   // bridge off, shaft free
struct Idle {};  // bridge on, current reference 0 (speed and position loops at rest)
struct Torque {
  double i_q = 0;
};  // A
struct Speed {
  double omega = 0;
  double i_q_max = 0;
};  // rad/s; A, 0 = the setting's limit
struct Position {
  double theta = 0;
  double omega_max = 0;
};  // rad; rad/s, 0 = the setting's limit
struct OpenLoop {
  double power = 0;
};  // −1..1, v_q as a share of the largest voltage the bus allows (MS series)
/// The current vector (MS drives: the voltage vector) turns by itself from the rotor's present
/// angle and pulls the rotor along, independent of the encoder. Drives calibrate this way.
struct Lead {
  double omega_e = 0;
};  // rad/s, electrical
using Setpoint = std::variant<Off, Idle, Torque, Speed, Position, OpenLoop, Lead>;

/// Gains as on the wire: 8 bits in `legacy`, 16 bits in `v236`, both on one scale. The page
/// docs/internals/model.md gives the rule that converts them to physical gains.
struct GainBytes {
  std::uint16_t angle_kp = 100, angle_ki = 100;
  std::uint16_t speed_kp = 50, speed_ki = 40;
  std::uint16_t current_kp = 50, current_ki = 50;
  std::uint16_t angle_kd = 0, speed_kd = 0, current_kd = 0;  // stored and read back, without effect
  friend bool operator==(const GainBytes&, const GainBytes&) = default;
};

/// Bits of errorState as the newest firmware numbers them (docs/reference/protocol.md §6).
enum class Error : std::uint8_t {
  kUnderVoltage = 0,
  kOverVoltage,
  kDriverTemperature,
  kMotorTemperature,
  kOverCurrent,
  kShort,
  kStall,
  kLostInput,
};
inline constexpr int kErrorKinds = 8;
using ErrorBits = std::uint8_t;  // bit n = Error(n)
constexpr ErrorBits bit(Error e) { return static_cast<ErrorBits>(1U << static_cast<unsigned>(e)); }

/// One protection: trips when its quantity has been beyond `threshold` for `delay`. The cause of
/// the error ends when the quantity has come back past the threshold by `hysteresis`. Units of
/// threshold and hysteresis, in the order of Error: V, V, °C, °C, A, A, s, s.
struct Protection {
  bool enabled = false;
  double threshold = 0;
  double hysteresis = 0;
  double delay = 0;         // s
  bool recoverable = true;  // false: only a power cycle or restart clears the error
  friend bool operator==(const Protection&, const Protection&) = default;
};

/// Registers of the drive that the loops and protections read. Limits that the host can set are in
/// SI units, at the rotor.
struct ControlSettings {
  GainBytes gains;
  double i_q_max = 16.0;      // A, > 0: "Max Torque Current" (not for Setpoint Torque)
  double power_max = 1.0;     // 0..1: "Max Power" of the MS series (not for Setpoint OpenLoop)
  double omega_max = 293.2;   // rad/s, > 0: "Max Speed"
  double accel_max = 0.0;     // rad/s², 0 = no ramp: "Max Acceleration"
  double current_ramp = 0.0;  // A/s, 0 = none
  std::array<Protection, kErrorKinds> protections{};  // indexed by Error
};

/// Values that the drive measures or estimates, after the last control tick; never the true state.
struct Telemetry {
  double temp_motor = 0;   // °C
  double temp_driver = 0;  // °C
  double v_bus = 0;        // V
  double i_bus = 0;        // A, estimated from duties and phase currents
  double i_q = 0;          // A; 0 on the MS series, see `power`
  double power = 0;        // −1..1, v_q as a share of the largest voltage the bus allows
  double i_a = 0, i_b = 0, i_c = 0;   // A
  double omega = 0;                   // rad/s, rotor
  std::int64_t encoder_position = 0;  // rotor counts, unwrapped since power-up; mod 2^bits = raw
  ErrorBits errors = 0;               // latched
  bool bridge_on = true;
  bool alive = true;  // the controller has power and has booted
};

/// The true state, for tests, plots and the bench; never an input of the control.
struct Truth {
  double theta_m = 0;                                         // rad, rotor, unwrapped
  double omega_m = 0;                                         // rad/s, rotor
  double theta_out = 0;                                       // rad, output
  double omega_out = 0;                                       // rad/s
  double i_d = 0, i_q = 0;                                    // A
  double tau_e = 0;                                           // Nm
  double v_bus = 0;                                           // V
  double temp_winding = 0, temp_housing = 0, temp_stage = 0;  // °C
  double i_q_ref = 0, omega_ref = 0, theta_ref = 0;           // references of the loops
  std::array<double, 3> duty_abc{};
};

/// Energy since power-up, J. Up to the integrator's error, `supply` is the sum of all other members
/// except `stored`, plus the change of `stored` (docs/internals/model.md §8).
struct EnergyLedger {
  double supply = 0;  // at the drive's terminals
  double copper = 0;
  double inverter = 0;  // including the drive's electronics
  double friction = 0;
  double gear = 0;
  double load = 0;    // work done on the constant load torque
  double stored = 0;  // link capacitor, inductances, kinetic, gear spring, cogging, gravity
};

}  // namespace lk::model
