#pragma once

/// @file Injectable faults of one drive (docs/internals/model.md §14), in SI units. The default is
/// a healthy drive. `DriveBank::set_faults` activates the faults.

#include <array>
#include <cstdint>
#include <optional>

#include "model/drive_params.hpp"

namespace lk::model {

/// Fault of a leg: one half bridge and the wire to its phase.
enum class LegFault : std::uint8_t {
  kNone,
  kPhaseOpen,    // the phase wire is broken: no current
  kHighOpen,     // the upper switch never closes; its diode works
  kLowOpen,      // the lower switch never closes; its diode works
  kHighShorted,  // the upper switch always conducts
  kLowShorted,   // the lower switch always conducts
};

enum class EncoderFault : std::uint8_t {
  kNone,
  kStuck,       // repeats the reading from when the fault began
  kGarbage,     // a random angle within the turn, new for each sample
  kLostMagnet,  // the last angle seen, plus a mean-reverting random walk and large noise
};

struct Faults {
  // Sensors
  EncoderFault encoder = EncoderFault::kNone;
  double encoder_offset = 0;   // rad, added to the magnet's angle: a jump or slow drift
  double encoder_noise = 0;    // rad rms, ≥ 0, added to the sensor's own noise in quadrature
  double encoder_latency = 0;  // s, ≥ 0, added to the sensor's own latency
  /// The channel reads `stuck` if set, else gain·x + offset. x: healthy reading without noise.
  struct Current {
    double offset = 0;              // A
    double gain = 1;                // 1
    std::optional<double> stuck{};  // A
    friend bool operator==(const Current&, const Current&) = default;
  };
  Current current_a{}, current_b{};
  double current_noise = 0;             // A rms, ≥ 0, added to both channels in quadrature
  std::optional<double> v_bus_stuck{};  // V
  double v_bus_offset = 0;              // V
  std::optional<double> temp_motor_stuck{}, temp_driver_stuck{};  // °C
  double temp_motor_offset = 0, temp_driver_offset = 0;           // K

  // Power stage
  bool bridge_dead = false;        // no switch ever closes; the firmware does not notice
  double commutation_offset = 0;   // rad electrical, added to the firmware's commutation angle
  std::array<LegFault, 3> legs{};  // phases a, b, c

  // Mechanics
  /// Dry friction added at the output. 1 is k_t·(full scale of the current sensors)·N, the torque
  /// of a lossless gear at the largest measurable current. From 1 on, the shaft is locked against
  /// any torque.
  double jam = 0;          // ≥ 0
  double friction = 1;     // ≥ 0, factor on Coulomb, static, viscous and output friction
  double inertia = 1;      // > 0, factor on rotor, flange and load
  double backlash = 1;     // ≥ 0, factor; no effect on a gear without stiffness
  double load_torque = 0;  // Nm at the output, added to the torque of the load
  /// Rotor and output are disconnected, each with its own inertia, friction and torques. When the
  /// fault ends, the output moves to the rotor's angle.
  bool coupling_broken = false;
  double theta_min = -kNoStop, theta_max = kNoStop;  // rad at the output; stops besides the load's
  double brake_delay = 0;  // s, ≥ 0, from switching the coil until the brake begins to move

  // Power
  double v_source_max = 1e9;     // V, upper limit of the source voltage
  bool supply_cut = false;       // disconnected; overrides `connect_supply`
  bool no_regeneration = false;  // the source accepts no current

  // Heat
  double R_housing_ambient = 1;  // > 0, factor on the resistance; > 1 cools worse

  // Controller
  /// Speed of the drive's clock relative to true time; > 1: the clock is fast. One second of the
  /// drive lasts 1/clock_ratio seconds, so all times and speeds of the firmware are wrong. The PWM
  /// frequency does not change.
  double clock_ratio = 1;  // > 0

  friend bool operator==(const Faults&, const Faults&) = default;
};

}  // namespace lk::model
