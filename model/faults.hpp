#pragma once

/// @file What can be broken about one drive (docs/model.md §14): a plain value, SI, healthy by
/// default. `DriveBank::set_faults` puts it in force.

#include <array>
#include <cstdint>
#include <optional>

#include "model/drive_params.hpp"

namespace lk::model {

/// One half bridge and the wire to its phase.
enum class LegFault : std::uint8_t {
  kNone,
  kPhaseOpen,    // the wire is broken: no current at all
  kHighOpen,     // the upper switch never closes; its diode works
  kLowOpen,      // the lower switch likewise
  kHighShorted,  // the upper switch is a wire
  kLowShorted,   // the lower switch is a wire
};

enum class EncoderFault : std::uint8_t {
  kNone,
  kStuck,       // shows what it showed when the fault began
  kGarbage,     // anything within the turn, anew for each sample
  kLostMagnet,  // where the magnet was last seen, wandering, with large noise
};

struct Faults {
  // Sensors
  EncoderFault encoder = EncoderFault::kNone;
  double encoder_offset = 0;   // rad of the magnet, added: a jump, or a drift if it is moved
  double encoder_noise = 0;    // rad rms, ≥ 0, in addition to the sensor's own (in quadrature)
  double encoder_latency = 0;  // s, ≥ 0, in addition
  /// The channel shows gain·(what it showed healthy) + offset, or `stuck`.
  struct Current {
    double offset = 0;              // A
    double gain = 1;                // 1
    std::optional<double> stuck{};  // A
    friend bool operator==(const Current&, const Current&) = default;
  };
  Current current_a{}, current_b{};
  double current_noise = 0;             // A rms, ≥ 0, in addition (in quadrature), both channels
  std::optional<double> v_bus_stuck{};  // V
  double v_bus_offset = 0;              // V
  std::optional<double> temp_motor_stuck{}, temp_driver_stuck{};  // °C
  double temp_motor_offset = 0, temp_driver_offset = 0;           // K

  // Power stage
  bool bridge_dead = false;        // the switches never close; the firmware does not know
  double commutation_offset = 0;   // rad electrical, of what the firmware commutates by
  std::array<LegFault, 3> legs{};  // phases a, b, c

  // Mechanics
  /// Dry friction added at the output, as a share of k_t·(full scale of the current sensors)·N, the
  /// torque a lossless gear would make of the largest current the drive can measure. From 1 on
  /// locked, whatever pushes.
  double jam = 0;          // ≥ 0
  double friction = 1;     // ≥ 0, factor on Coulomb, static and viscous friction and the output's
  double inertia = 1;      // > 0, factor on rotor, flange and load
  double backlash = 1;     // ≥ 0, factor; a gear without stiffness has none
  double load_torque = 0;  // Nm at the output, added to the load's
  /// Rotor and output are apart, each with its own inertia, friction and torques; healed, the
  /// output is put back to where the rotor is.
  bool coupling_broken = false;
  double theta_min = -kNoStop, theta_max = kNoStop;  // rad at the output, beside the load's own
  double brake_delay = 0;  // s, ≥ 0, from switching the coil until the brake begins to move

  // Power
  double v_source_max = 1e9;     // V, the source gives no more than this
  bool supply_cut = false;       // disconnected, whatever `connect_supply` says
  bool no_regeneration = false;  // the source takes nothing back

  // Heat
  double R_housing_ambient = 1;  // > 0, factor: the housing gets rid of its heat worse

  // Controller
  /// The drive's clock against true time: > 1 runs fast. All the firmware measures and times with
  /// it is off: a second of the drive's is 1/clock_ratio of a second. The switching frequency
  /// stays.
  double clock_ratio = 1;  // > 0

  friend bool operator==(const Faults&, const Faults&) = default;
};

}  // namespace lk::model
