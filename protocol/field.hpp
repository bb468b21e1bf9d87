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

/// A little-endian integer. The last one is the multi-turn angle's, seven bytes.
enum class Wire : std::uint8_t { kU8, kI8, kU16, kI16, kU32, kI32, kI56 };

constexpr int bytes_of(Wire wire) {
  constexpr int kBytes[] = {1, 1, 2, 2, 4, 4, 7};
  return kBytes[static_cast<int>(wire)];
}
constexpr bool is_signed(Wire wire) {
  return wire == Wire::kI8 || wire == Wire::kI16 || wire == Wire::kI32 || wire == Wire::kI56;
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

constexpr double lsb(Scale scale, const WireFormat& format) {
  switch (scale) {
    case Scale::kOne:
    case Scale::kFlag:
    case Scale::kBridge:
      return 1;
    case Scale::kHundredth:
    case Scale::kCenti:
      return 0.01;
    case Scale::kThousandth:
      return 0.001;
    case Scale::kIqCommand:
      return format.iq_command_lsb_A;
    case Scale::kIqReply:
      return format.iq_reply_lsb_A;
    case Scale::kPhaseCurrent:
      return format.phase_current_lsb_A;
    case Scale::kVoltage:
      return format.voltage_lsb_V;
  }
  return 1;
}

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

/// What a field can be; most in integers of the wire.
enum class Range : std::uint8_t {
  kWidth,         // whatever its bits can be
  kWords,         // one of its words
  kIqCommand,     // ±Dialect::iq_command_limit_lsb
  kIqLimit,       // 0..Dialect::iq_command_limit_lsb
  kIqReply,       // ±2048
  kOpenLoop,      // ±850 per mille
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
  std::string_view key = {};    // of decode and logs, its unit at the end
  std::string_view word = {};   // of scenarios, where it is not the key
  std::uint8_t byte = 0;        // DATA[byte] is its lowest
  Wire wire = Wire::kU8;
  Scale scale = Scale::kOne;
  Unit unit = Unit::kNone;
  Range range = Range::kWidth;
  Beyond beyond = Beyond::kClamped;
  When when = kAlways;
  int parameter = -1;  // >= 0: only where DATA[1] is this
  Period period = Period::kNone;
  bool zero_is_none = false;   // 0 says nothing
  bool may_be_unsaid = false;  // in words: 0 where it is
  std::span<const Value> values = {};
  std::span<const Flag> flags = {};  // from bit 0 on

  /// How scenarios call it.
  constexpr std::string_view spoken() const { return word.empty() ? key : word; }
};

struct RawRange {
  std::int64_t min, max;
};

/// What the bits of a field can be.
constexpr RawRange width(Wire wire) {
  const int bits = 8 * bytes_of(wire) - (is_signed(wire) ? 1 : 0);
  const std::int64_t max = (std::int64_t{1} << bits) - 1;
  return {is_signed(wire) ? -max - 1 : 0, max};
}

/// The range of a field on the wire; its width where the drive's settings decide.
constexpr RawRange raw_range(Range range, Wire wire, const WireFormat& format) {
  const std::int64_t iq = format.dialect.iq_command_limit_lsb;
  switch (range) {
    case Range::kIqCommand:
      return {-iq, iq};
    case Range::kIqLimit:
      return {0, iq};
    case Range::kIqReply:
      return {-kIqReplyLimit_lsb, kIqReplyLimit_lsb};
    case Range::kOpenLoop:
      return {-kOpenLoopLimit_permille, kOpenLoopLimit_permille};
    case Range::kPowerReply:
      return {-kPowerReplyLimit_permille, kPowerReplyLimit_permille};
    case Range::kTurn:
      return {0, kTurn_cdeg - 1};
    case Range::kWidth:
    case Range::kWords:
    case Range::kCircle:
    case Range::kMaxSpeed:
    case Range::kMaxAngle:
    case Range::kEncoder:
    case Range::kNotNegative:
    case Range::kMaxCurrent:
    case Range::kSpeedSetting:
    case Range::kAngleSetting:
    case Range::kCurrentRamp:
      return width(wire);
  }
  return width(wire);
}

constexpr RawRange raw_range(const Field& field, const WireFormat& format) {
  return raw_range(field.range, field.wire, format);
}

/// Is the field in frames whose DATA[1] is `second`?
constexpr bool present(const Field& field, std::uint8_t second, const WireFormat& format) {
  return (field.parameter < 0 || field.parameter == second) && field.when.on(format);
}

/// The number that a drive takes for one that a host has written.
constexpr std::int64_t taken(const Field& field, std::int64_t raw, const WireFormat& format) {
  if (field.beyond != Beyond::kClamped) return raw;
  const RawRange range = raw_range(field, format);
  return std::clamp(raw, range.min, range.max);
}

/// The number of a field in DATA.
std::int64_t raw(const Field& field, const Payload& data);

/// Writes the number to DATA; it has to be within the field's width.
void put(const Field& field, std::int64_t raw, Payload& data);

/// A number of the wire in the unit of the field's key.
double quantity(const Field& field, std::int64_t raw, const WireFormat& format);
/// The number of the wire that is nearest to a quantity, within the field's width. Not for kFlag
/// and kBridge, which replies alone have.
std::int64_t raw_of(const Field& field, double quantity, const WireFormat& format);

}  // namespace lk::protocol
