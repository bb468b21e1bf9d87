#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "protocol/opcodes.hpp"

namespace lk::protocol {

/// MS: voltage mode, no current sensors. MG: geared.
enum class Series : std::uint8_t { kMs, kMf, kMg, kMh };
inline constexpr const char* kSeriesNames[] = {"MS", "MF", "MG", "MH"};
inline constexpr const char* name_of(Series series) {
  return kSeriesNames[static_cast<std::size_t>(series)];
}

/// Layout of state 1, the reply to 0x9A and 0x9B (docs/reference/protocol.md §10.1).
enum class State1Layout : std::uint8_t { kDeciVolt, kCentiVolt, kCentiVoltAndBusCurrent };

/// Effect of 0x95. In order: none; as the manual intends; sets the angle to its payload; sets the
/// angle to 0.
enum class ClearAngleMeaning : std::uint8_t { kIgnored, kImplemented, kSetsAngle, kZero };

/// Scale of currents: the one that the manual prints, or series_current_lsb_A().
enum class CurrentScale : std::uint8_t { kManual, kSeries };

/// Framing of bytes: CAN, or the packets of RS-485 (docs/reference/rs485.md).
enum class Framing : std::uint8_t { kCan, kSerial };

/// Differences between firmware generations on the wire. Each has its own switch, because real
/// drives mix them. A `…_command` switch: the drive has the commands in the comment.
struct Dialect {
  Framing framing = Framing::kCan;
  State1Layout state_1 = State1Layout::kDeciVolt;
  bool wide_single_turn = false;         // reply to 0x94: uint32 at DATA[4..7]
  bool wide_single_turn_target = false;  // 0xA5, 0xA6: uint32 at DATA[4..7]
  bool pid_commands = true;              // 0x30..0x34
  bool offset_command = true;            // 0x91
  ClearAngleMeaning clear_angle = ClearAngleMeaning::kIgnored;
  bool open_loop_command = false;   // 0xA0, MS only
  bool speed_iq_limit = false;      // 0xA2: iq limit at DATA[2..3]; Max Speed limits the command
  bool brake_command = false;       // 0x8C
  bool parameter_commands = false;  // 0xC0, 0xC1
  bool parameter_ranges = false;    // 0xC1 clamps to the printed ranges, replies the value in force
  bool multi_drive_more = false;    // 0x281, 0x282, 0x288
  bool max_torque_commands = true;  // 0x37, 0x38
  bool setting_commands = false;    // 0x40, 0x42, 0x44; the settings differ between CAN and RS-485
  bool restart_command = false;     // 0x07
  bool calibrate_command = false;   // 0x18
  bool zero_stops = false;          // after 0x95 the drive stops as after 0x81
  bool wide_zero_reply = false;     // reply to 0x19: uint32 at DATA[4..7]
  std::uint8_t state_on_byte = 0;   // DATA[6] of state 1 while on; while off: kBridgeOff
  bool all_error_bits = false;      // state 1 has all error bits; false: only bits 0 and 3
  std::int16_t iq_command_limit_lsb = 2000;
  CurrentScale iq_scale = CurrentScale::kManual;
  CurrentScale phase_current_scale = CurrentScale::kManual;
  std::uint32_t reply_id_base = kSingleDriveId;  // identifier of replies minus the ID
  // For RS-485 only.
  bool clear_turns_command = false;             // 0x93
  bool zero_ram_command = true;                 // 0x95
  std::uint8_t zero_ram_len = 0;                // LEN of 0x95: 0, or 7
  bool typed_encoder = false;                   // 0x90 has a type, its reply a 32-bit position
  bool zero_answered = true;                    // 0x19 has a reply
  std::int16_t open_loop_limit_permille = 850;  // range of 0xA0
  std::uint8_t product_info_bytes = 58;         // of the reply to 0x12: 58, 42; 0: no reply
  bool tool_commands = true;                    // 0x10, 0x11, 0x14..0x17, 0x1F, 0x20, 0x48, 0x4A
  bool restore_command = false;                 // 0x89
  bool lax_length = false;                      // the drive accepts queries with a wrong LEN

  friend bool operator==(const Dialect&, const Dialect&) = default;
};

inline constexpr Dialect kLegacyDialect{};
inline constexpr Dialect kLateLegacyDialect{
    .wide_single_turn = true,
    .iq_command_limit_lsb = 2048,
    .iq_scale = CurrentScale::kSeries,
};
inline constexpr Dialect kV235Dialect{
    .state_1 = State1Layout::kCentiVolt,
    .wide_single_turn = true,
    .wide_single_turn_target = true,
    .pid_commands = false,
    .open_loop_command = true,
    .max_torque_commands = false,
    .all_error_bits = true,
    .iq_command_limit_lsb = 2048,
    .iq_scale = CurrentScale::kSeries,
};
inline constexpr Dialect kV236Dialect = [] {
  Dialect dialect = kV235Dialect;
  dialect.state_1 = State1Layout::kCentiVoltAndBusCurrent;
  dialect.offset_command = false;
  dialect.clear_angle = ClearAngleMeaning::kSetsAngle;
  dialect.speed_iq_limit = true;
  dialect.brake_command = true;
  dialect.parameter_commands = true;
  dialect.multi_drive_more = true;
  dialect.phase_current_scale = CurrentScale::kSeries;
  return dialect;
}();
inline constexpr Dialect kV236bDialect = [] {
  Dialect dialect = kV236Dialect;
  dialect.clear_angle = ClearAngleMeaning::kZero;
  dialect.parameter_ranges = true;
  dialect.setting_commands = true;
  dialect.restart_command = true;
  dialect.calibrate_command = true;
  dialect.zero_stops = true;
  dialect.wide_zero_reply = true;
  return dialect;
}();

// Dialects of the RS-485 manuals: kM23 is of the oldest, kM35 of V2.35, kM36 of V2.36.
inline constexpr Dialect kM23Dialect{
    .framing = Framing::kSerial,
    .wide_single_turn = true,
    .open_loop_command = true,
    .multi_drive_more = true,
    .zero_ram_command = false,
    .zero_answered = false,
    .open_loop_limit_permille = 1000,
    .product_info_bytes = 42,
};
inline constexpr Dialect kLateM23Dialect = [] {
  Dialect dialect = kM23Dialect;
  dialect.iq_command_limit_lsb = 2048;
  dialect.iq_scale = CurrentScale::kSeries;
  return dialect;
}();
inline constexpr Dialect kM35Dialect{
    .framing = Framing::kSerial,
    .state_1 = State1Layout::kCentiVoltAndBusCurrent,
    .wide_single_turn = true,
    .wide_single_turn_target = true,
    .pid_commands = false,
    .offset_command = false,
    .clear_angle = ClearAngleMeaning::kSetsAngle,
    .open_loop_command = true,
    .brake_command = true,
    .multi_drive_more = true,
    .max_torque_commands = false,
    .setting_commands = true,
    .all_error_bits = true,
    .iq_command_limit_lsb = 2048,
    .iq_scale = CurrentScale::kSeries,
    .phase_current_scale = CurrentScale::kSeries,
    .clear_turns_command = true,
};
inline constexpr Dialect kM36Dialect = [] {
  Dialect dialect = kM35Dialect;
  dialect.speed_iq_limit = true;
  dialect.parameter_commands = true;
  dialect.parameter_ranges = true;
  dialect.setting_commands = false;
  dialect.clear_turns_command = false;
  dialect.zero_ram_len = 7;
  dialect.typed_encoder = true;
  return dialect;
}();
/// The second print of V2.36 has no RS-485 part. Assumed: the new commands of the second print, in
/// the packets of the first print.
inline constexpr Dialect kM36bDialect = [] {
  Dialect dialect = kM36Dialect;
  dialect.restart_command = true;
  dialect.calibrate_command = true;
  dialect.zero_stops = true;
  dialect.wide_zero_reply = true;
  return dialect;
}();

/// Name and dialects of a generation of firmware.
struct GenerationRow {
  std::string_view name;
  Dialect dialect;  // on CAN
  Dialect serial;   // on RS-485
};
/// All generations, from old to new (docs/reference/protocol.md §10.1).
inline constexpr std::array kGenerationRows = std::to_array<GenerationRow>({
    {"legacy", kLegacyDialect, kM23Dialect},
    {"late-legacy", kLateLegacyDialect, kLateM23Dialect},
    {"v235", kV235Dialect, kM35Dialect},
    {"v236", kV236Dialect, kM36Dialect},
    {"v236b", kV236bDialect, kM36bDialect},
});

/// Wire format of a drive: its dialect, and the LSBs that differ between drives. The LSBs of all
/// other quantities (0.01°, 0.01 dps, 1 dps, 1 dps/s, 1 °C) are the same for all drives.
struct WireFormat {
  Dialect dialect;
  Series series = Series::kMf;
  double iq_command_lsb_A = 0;     // 0xA1, 0xA2, 0x280, Max Torque Current
  double iq_reply_lsb_A = 0;       // state 2; unused on MS, where the field is the power
  double phase_current_lsb_A = 0;  // state 3
  double voltage_lsb_V = 0;        // state 1

  friend bool operator==(const WireFormat&, const WireFormat&) = default;
};

/// One turn in 0.01°. Single-turn targets are smaller, unless they count turns of a gear's output.
inline constexpr std::uint16_t kTurn_cdeg = 36000;
inline constexpr std::int16_t kIqReplyLimit_lsb = 2048;
inline constexpr std::int16_t kPowerReplyLimit_permille = 1000;  // MS
inline constexpr std::int16_t kMaxPower_permille = 850;          // Max Power

/// Returns the LSB of currents, A. Full scale is ±2048: ±33 A on MG, ±16.5 A on the others. MS
/// drives measure no current: an iq limit has no meaning for them, but still needs a scale.
constexpr double series_current_lsb_A(Series series) {
  return series == Series::kMg ? 66.0 / 4096.0 : 33.0 / 4096.0;
}

constexpr WireFormat wire_format(const Dialect& dialect, Series series) {
  const bool by_series = dialect.iq_scale == CurrentScale::kSeries;
  const bool phases_by_series = dialect.phase_current_scale == CurrentScale::kSeries;
  // By the manual, ±2000 is ±32 A in commands, and ±2048 is ±33 A in replies.
  return {
      .dialect = dialect,
      .series = series,
      .iq_command_lsb_A = by_series ? series_current_lsb_A(series) : 32.0 / 2000.0,
      .iq_reply_lsb_A = by_series ? series_current_lsb_A(series) : 33.0 / 2048.0,
      .phase_current_lsb_A = phases_by_series ? series_current_lsb_A(series) : 1.0 / 64.0,
      .voltage_lsb_V = dialect.state_1 == State1Layout::kDeciVolt ? 0.1 : 0.01,
  };
}

inline constexpr WireFormat kLegacyFormat = wire_format(kLegacyDialect, Series::kMf);

}  // namespace lk::protocol
