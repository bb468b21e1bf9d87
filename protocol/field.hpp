#pragma once

/// @file How one field of the wire is described: what command_table.hpp has a row of for each.

#include <algorithm>
#include <cstdint>
#include <limits>
#include <span>
#include <string_view>

#include "protocol/wire.hpp"
#include "protocol/wire_format.hpp"

namespace lk::protocol {

/// A little-endian integer. The multi-turn angle has seven bytes on CAN and eight on RS-485.
enum class Wire : std::uint8_t { kU8, kI8, kU16, kI16, kU32, kI32, kI56, kU24, kI64 };

constexpr int bytes_of(Wire wire) {
  constexpr int kBytes[] = {1, 1, 2, 2, 4, 4, 7, 3, 8};
  return kBytes[static_cast<int>(wire)];
}
constexpr bool is_signed(Wire wire) {
  return wire == Wire::kI8 || wire == Wire::kI16 || wire == Wire::kI32 || wire == Wire::kI56 ||
         wire == Wire::kI64;
}

/// A quantity in its unit, of the number on the wire.
enum class Scale : std::uint8_t {
  kOne,
  kHundredth,     // n / 100, where the member is the integer
  kThousandth,    // n / 1000, likewise
  kCenti,         // n · 0.01
  kIqCommand,     // n · WireFormat::iq_command_lsb_A
  kIqReply,       // n · WireFormat::iq_reply_lsb_A
  kPhaseCurrent,  // n · WireFormat::phase_current_lsb_A
  kVoltage,       // n · WireFormat::voltage_lsb_V
  kFlag,          // 1 unless n is 0
  kBridge,        // 1 unless n is 0x10, which says that the bridge is off
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

/// How a unit is written: in ASCII, and as people write it. Counts have no unit.
struct UnitTexts {
  std::string_view ascii, symbol;
};
constexpr UnitTexts texts_of(Unit unit) {
  constexpr UnitTexts kTexts[] = {
      {"", ""},       {"", ""},  {"degC", "°C"}, {"V", "V"},       {"A", "A"},
      {"A/s", "A/s"}, {"", "‰"}, {"deg", "°"},   {"deg/s", "°/s"}, {"deg/s^2", "°/s²"}};
  return kTexts[static_cast<std::size_t>(unit)];
}

/// What a field can be; most in integers of the wire.
enum class Range : std::uint8_t {
  kWidth,         // whatever its bits can be
  kWords,         // one of its words
  kIqCommand,     // ±Dialect::iq_command_limit_lsb
  kIqLimit,       // 0..Dialect::iq_command_limit_lsb
  kIqReply,       // ±2048
  kOpenLoop,      // ±Dialect::open_loop_limit_permille
  kPowerReply,    // ±1000 per mille
  kTurn,          // 0..35999
  kCircle,        // 0..what 0x94 of the drive can read
  kMaxSpeed,      // ± the drive's Max Speed
  kMaxAngle,      // ± the drive's Max Angle
  kEncoder,       // 0..the drive's largest count
  kNotNegative,   // 0..
  kMaxCurrent,    // a Max Torque Current, on MS a Max Power
  kSpeedSetting,  // a Max Speed
  kAngleSetting,  // a Max Angle
  kCurrentRamp,   // a current ramp
  kMaxTorque,     // a Max Torque Current or Power in 0x38
  kBetween,       // Field::min..Field::max
};

/// What becomes of a value out of range.
enum class Beyond : std::uint8_t {
  kClamped,         // the nearest in range, already on the wire
  kDriveClamps,     // the nearest in range: the drive knows which
  kNotExecuted,     // answered, not executed
  kUnknownCommand,  // no reply
};

/// In which a value begins anew.
enum class Period : std::uint8_t { kNone, kEncoder, kCircle };

/// What a number stands for.
struct Value {
  unsigned number = 0;
  std::string_view word;
};

/// A bit of a field that has a meaning of its own.
struct Flag {
  std::string_view name, label;
};

/// Where a command or a field exists.
struct When {
  std::string_view words;  // for people: the quirk that decides
  bool (*on)(const WireFormat& format);
};
inline constexpr When kAlways{"", [](const WireFormat&) { return true; }};

struct Field {
  std::string_view name = {};   // of DBC and Wireshark: the same name is the same bits
  std::string_view label = {};  // for people
  std::string_view key = {};    // of its quantity, which has the unit
  std::string_view word = {};   // of scenarios, where it is not the key
  std::uint8_t byte = 0;        // DATA[byte] is its lowest
  Wire wire = Wire::kU8;
  Scale scale = Scale::kOne;
  Unit unit = Unit::kNone;
  Range range = Range::kWidth;
  Beyond beyond = Beyond::kClamped;
  When when = kAlways;
  int parameter = -1;             // >= 0: only where DATA[1] is this
  int item = -1;                  // >= 0: and DATA[2] is this
  std::int32_t min = 0, max = 0;  // of Range::kBetween
  Period period = Period::kNone;
  bool zero_is_none = false;   // 0 says nothing
  bool may_be_unsaid = false;  // in words: 0 where it is
  // Of RS-485, whose packets have a length:
  std::uint8_t end = 0;   // zeros follow up to DATA[end]; 0: none
  bool optional = false;  // packets may end before it
  std::span<const Value> values = {};
  std::span<const Flag> flags = {};  // from bit 0 on

  /// How scenarios call it.
  constexpr std::string_view spoken() const { return word.empty() ? key : word; }
};

}  // namespace lk::protocol
