#pragma once

#include <cstdint>

#include "protocol/opcodes.hpp"

namespace lk::protocol {

/// MS: voltage mode, no current sensors. MG: geared.
enum class Series : std::uint8_t { kMs, kMf, kMg, kMh };

/// Replies to 0x9A and 0x9B (docs/protocol.md §7).
enum class State1Layout : std::uint8_t { kDeciVolt, kCentiVolt, kCentiVoltAndBusCurrent };

/// What 0x95 does: nothing; what the manual says it is meant to do; take the angle in its payload.
enum class ClearAngleMeaning : std::uint8_t { kIgnored, kImplemented, kSetsAngle };

/// How much one LSB of a current is: as the manual prints it, or by series.
enum class CurrentScale : std::uint8_t { kManual, kSeries };

/// What sets the generations of firmware apart on the wire, each its own switch: mixtures exist.
struct Dialect {
  State1Layout state_1 = State1Layout::kDeciVolt;
  bool wide_single_turn = false;         // 0x94: uint32 at 4–7
  bool wide_single_turn_target = false;  // 0xA5, 0xA6: uint32 at 4–7
  bool pid_commands = true;              // 0x30..0x34
  bool offset_command = true;            // 0x91
  ClearAngleMeaning clear_angle = ClearAngleMeaning::kIgnored;
  bool open_loop_command = false;   // 0xA0, MS only
  bool speed_iq_limit = false;      // 0xA2: iq limit at 2–3, and Max Speed limits the command
  bool brake_command = false;       // 0x8C
  bool parameter_commands = false;  // 0xC0, 0xC1
  bool multi_drive_more = false;    // 0x281, 0x282, 0x288
  bool all_error_bits = false;      // else bits 0 and 3
  std::int16_t iq_command_limit_lsb = 2000;
  CurrentScale iq_scale = CurrentScale::kManual;
  CurrentScale phase_current_scale = CurrentScale::kManual;
  std::uint32_t reply_id_base = kSingleDriveId;

  friend bool operator==(const Dialect&, const Dialect&) = default;
};

inline constexpr Dialect kLegacyDialect{};
inline constexpr Dialect kV235Dialect{
    .state_1 = State1Layout::kCentiVolt,
    .wide_single_turn = true,
    .wide_single_turn_target = true,
    .pid_commands = false,
    .open_loop_command = true,
    .all_error_bits = true,
    .iq_command_limit_lsb = 2048,
    .iq_scale = CurrentScale::kSeries,
};
inline constexpr Dialect kV236Dialect{
    .state_1 = State1Layout::kCentiVoltAndBusCurrent,
    .wide_single_turn = true,
    .wide_single_turn_target = true,
    .pid_commands = false,
    .offset_command = false,
    .clear_angle = ClearAngleMeaning::kSetsAngle,
    .open_loop_command = true,
    .speed_iq_limit = true,
    .brake_command = true,
    .parameter_commands = true,
    .multi_drive_more = true,
    .all_error_bits = true,
    .iq_command_limit_lsb = 2048,
    .iq_scale = CurrentScale::kSeries,
    .phase_current_scale = CurrentScale::kSeries,
};

/// The scales that differ between generations and series of drives: how much one LSB is. Everything
/// else on the wire (0.01°, 0.01 dps, 1 dps, 1 dps/s, 1 °C) has one scale for all of them.
struct WireFormat {
  double iq_command_lsb_A;            // 0xA1, 0x280
  std::int16_t iq_command_limit_lsb;  // commands beyond are clamped
  double iq_reply_lsb_A;              // state 2
  std::int16_t iq_reply_limit_lsb;
  double phase_current_lsb_A;  // state 3
  double voltage_lsb_V;        // state 1
};

/// The manual's drive: ±2000 is ±32 A in commands, ±2048 is ±33 A in replies.
inline constexpr WireFormat kLegacyFormat{
    .iq_command_lsb_A = 32.0 / 2000.0,
    .iq_command_limit_lsb = 2000,
    .iq_reply_lsb_A = 33.0 / 2048.0,
    .iq_reply_limit_lsb = 2048,
    .phase_current_lsb_A = 1.0 / 64.0,
    .voltage_lsb_V = 0.1,
};

}  // namespace lk::protocol
