#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "emulator/sim_time.hpp"
#include "model/drive_params.hpp"
#include "model/setpoint.hpp"

namespace lk::emulator {

enum class Series : std::uint8_t { kMs, kMf, kMg, kMh };

/// Which turn the encoder field of the wire spans on geared motors (docs/protocol.md §7).
enum class EncoderSpan : std::uint8_t { kRotorTurn, kOutputTurn };

/// The drive's parameter memory. RAM starts as a copy of ROM at power-up.
struct Registers {
  model::GainBytes gains;
  std::int32_t acceleration_dps_s = 0;         // 0 = no ramp
  std::uint16_t encoder_offset = 0;            // wire counts
  std::int32_t max_torque_current_lsb = 1000;  // 0..2000, units of the iq command
  double max_speed_dps = 16800;                // > 0
  double max_angle_deg = 0;                    // 0 = no limit
  double current_ramp_A_s = 0;                 // of the speed and position loops; 0 = none
  bool broadcast_mode = false;                 // answers 0x280 only
  std::array<model::Protection, model::kErrorKinds> protections{};  // by model::Error, SI

  friend bool operator==(const Registers&, const Registers&);
};

/// Misprints of the manual and open points of the protocol, each its own switch (docs/protocol.md).
struct Quirks {
  bool manual_reply_bytes = false;  // DATA[0] of 0x9B, 0xA7, 0xA8 replies as the manual prints them
  bool clear_angle_implemented = false;   // 0x95 does what it is meant to do
  bool offset_write_takes_effect = true;  // 0x91 is in force at once
  bool run_resumes = true;                // 0x88 after 0x81 resumes the earlier mode
  bool stop_holds = false;                // 0x81 holds the position instead of freeing the shaft

  friend bool operator==(const Quirks&, const Quirks&) = default;
};

/// What the vendor prints, at the output shaft; 0 = not printed.
struct Rating {
  double torque_rated_Nm = 0;
  double torque_peak_Nm = 0;
  double speed_rated_rpm = 0;
  double speed_no_load_rpm = 0;
};

/// What a motor file says.
struct Profile {
  std::string name;   // "mf7015"
  std::string model;  // "MF7015-10T"
  Series series = Series::kMf;
  Rating rating;
  model::DriveParams drive;
  EncoderSpan encoder_span = EncoderSpan::kRotorTurn;
  Registers factory;
};

struct ServoConfig {
  int id = 1;  // 1..32
  Profile profile;
  Registers rom;  // starts as profile.factory
  Quirks quirks;
  SimTime reply_time = std::chrono::microseconds(100);  // after the query's last bit
  std::optional<double> boot_angle_deg;                 // rotor; drawn from seed and ID when absent
};

struct BusConfig {
  std::string interface;             // "vcan0"
  std::int64_t bitrate = 1'000'000;  // bit/s; 0 = frames take no time and drives answer at once
  std::uint64_t seed = 1;
  std::vector<ServoConfig> servos;  // ascending, distinct IDs
};

}  // namespace lk::emulator
