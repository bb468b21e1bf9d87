#pragma once

/// @file Description of one field on the wire; command_table.hpp has a row for each field.

#include <algorithm>
#include <cstdint>
#include <limits>
#include <span>
#include <string_view>

#include "protocol/wire.hpp"
#include "protocol/wire_format.hpp"

namespace lk::protocol {

/// Type of a little-endian integer. The multi-turn angle is kI56 on CAN and kI64 on RS-485.
enum class Wire : std::uint8_t { kU8, kI8, kU16, kI16, kU32, kI32, kI56, kU24, kI64 };

constexpr int bytes_of(Wire wire) {
  constexpr int kBytes[] = {1, 1, 2, 2, 4, 4, 7, 3, 8};
  return kBytes[static_cast<int>(wire)];
}
constexpr bool is_signed(Wire wire) {
  return wire == Wire::kI8 || wire == Wire::kI16 || wire == Wire::kI32 || wire == Wire::kI56 ||
         wire == Wire::kI64;
}

/// Conversion of the number n on the wire to a quantity in its unit.
enum class Scale : std::uint8_t {
  kOne,
  kHundredth,     // n / 100; the member is the integer n
  kThousandth,    // n / 1000; the member is the integer n
  kCenti,         // n · 0.01
  kIqCommand,     // n · WireFormat::iq_command_lsb_A
  kIqReply,       // n · WireFormat::iq_reply_lsb_A
  kPhaseCurrent,  // n · WireFormat::phase_current_lsb_A
  kVoltage,       // n · WireFormat::voltage_lsb_V
  kFlag,          // 1 unless n is 0
  kBridge,        // 1 unless n is 0x10 (bridge off)
};
inline constexpr std::uint8_t kBridgeOff = 0x10;

enum class Unit : std::uint8_t {
  kNone,
  kCounts,
  kCelsius,
  kVolt,
  kAmpere,
  kAmperePerSecond,
  kPermille,
  kDegree,
  kDegreePerSecond,
  kDegreePerSecond2,
};

/// Text of a unit: in ASCII, and with symbols such as °. Encoder counts have no text.
struct UnitTexts {
  std::string_view ascii, symbol;
};
constexpr UnitTexts texts_of(Unit unit) {
  constexpr UnitTexts kTexts[] = {
      {"", ""},       {"", ""},  {"degC", "°C"}, {"V", "V"},       {"A", "A"},
      {"A/s", "A/s"}, {"", "‰"}, {"deg", "°"},   {"deg/s", "°/s"}, {"deg/s^2", "°/s²"}};
  return kTexts[static_cast<std::size_t>(unit)];
}

/// Range of a field. Numbers are integers on the wire.
enum class Range : std::uint8_t {
  kWidth,         // all values that fit in the field
  kWords,         // one of Field::values
  kIqCommand,     // ±Dialect::iq_command_limit_lsb
  kIqLimit,       // 0..Dialect::iq_command_limit_lsb
  kIqReply,       // ±2048
  kOpenLoop,      // ±Dialect::open_loop_limit_permille
  kPowerReply,    // ±1000 per mille
  kTurn,          // 0..35999
  kCircle,        // 0..the largest angle in the drive's reply to 0x94
  kMaxSpeed,      // ± the drive's Max Speed
  kMaxAngle,      // ± the drive's Max Angle
  kEncoder,       // 0..the drive's largest count
  kNotNegative,   // 0..the largest value that fits in the field
  kMaxCurrent,    // valid values of Max Torque Current, on MS of Max Power
  kSpeedSetting,  // valid values of Max Speed
  kAngleSetting,  // valid values of Max Angle
  kCurrentRamp,   // valid values of the current ramp
  kMaxTorque,     // valid values of Max Torque Current or Max Power in 0x38
  kBetween,       // Field::min..Field::max
};

/// Treatment of a query with a value out of range.
enum class Beyond : std::uint8_t {
  kClamped,         // the codec clamps the value
  kDriveClamps,     // the drive clamps the value, because only the drive knows the range
  kNotExecuted,     // the drive replies but does not execute the query
  kUnknownCommand,  // the drive does not reply
};

/// Where a value wraps around: not at all, after a turn of the encoder, after a turn of 0x94.
enum class Period : std::uint8_t { kNone, kEncoder, kCircle };

/// A number of a field and the word for its meaning.
struct Value {
  unsigned number = 0;
  std::string_view word;
};

/// Name and label of one bit of a field.
struct Flag {
  std::string_view name, label;
};

/// Condition under which a command or a field exists.
struct When {
  std::string_view words;  // for people: the quirk that decides, e.g. "pid_commands = true"
  bool (*on)(const WireFormat& format);
};
inline constexpr When kAlways{"", [](const WireFormat&) { return true; }};

struct Field {
  std::string_view name = {};   // in DBC and Wireshark; equal names mean equal bits
  std::string_view label = {};  // for people
  std::string_view key = {};    // of the field's Quantity, which defines the unit
  std::string_view word = {};   // name in scenarios; empty: `key`
  std::uint8_t byte = 0;        // DATA[byte] is its lowest byte
  Wire wire = Wire::kU8;
  Scale scale = Scale::kOne;
  Unit unit = Unit::kNone;
  Range range = Range::kWidth;
  Beyond beyond = Beyond::kClamped;
  When when = kAlways;
  int parameter = -1;             // >= 0: the field exists only if DATA[1] has this value
  int item = -1;                  // >= 0: the field exists only if DATA[2] has this value
  std::int32_t min = 0, max = 0;  // limits of Range::kBetween
  Period period = Period::kNone;
  bool zero_means_absent = false;         // a frame with 0 gives no value
  bool is_optional_in_scenarios = false;  // optional in scenarios; default 0
  // For RS-485, whose packets have a length:
  std::uint8_t end = 0;   // the packet has zeros up to DATA[end - 1]; 0: no zeros
  bool optional = false;  // packets may end before this field
  std::span<const Value> values = {};
  std::span<const Flag> flags = {};  // of the field's bits, from bit 0 on

  /// Returns the name of the field in scenarios.
  constexpr std::string_view input_key() const { return word.empty() ? key : word; }
};

}  // namespace lk::protocol
