#pragma once

/// @file Reads, writes, limits and converts the raw numbers of fields.

#include <algorithm>
#include <cstdint>

#include "protocol/field.hpp"
#include "protocol/wire.hpp"
#include "protocol/wire_format.hpp"

namespace lk::protocol {

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

struct RawRange {
  std::int64_t min, max;
};

/// Returns the range of the numbers that fit in the field.
constexpr RawRange width(Wire wire) {
  const int bits = 8 * bytes_of(wire) - (is_signed(wire) ? 1 : 0);
  const auto max = static_cast<std::int64_t>((std::uint64_t{1} << bits) - 1);
  return {is_signed(wire) ? -max - 1 : 0, max};
}

/// Returns the range of a field on the wire. If only the drive's settings define the range, returns
/// all numbers that fit in the field.
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
      return {-format.dialect.open_loop_limit_permille, format.dialect.open_loop_limit_permille};
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
    case Range::kMaxTorque:
    case Range::kBetween:  // see the overload for Field
      return width(wire);
  }
  return width(wire);
}

constexpr RawRange raw_range(const Field& field, const WireFormat& format) {
  if (field.range == Range::kBetween) return {field.min, field.max};
  return raw_range(field.range, field.wire, format);
}

/// Returns true if a frame with this DATA has the field.
constexpr bool present(const Field& field, const Payload& data, const WireFormat& format) {
  return (field.parameter < 0 || field.parameter == data[1]) &&
         (field.item < 0 || field.item == data[2]) && field.when.on(format);
}

/// Returns the number that a drive uses if the host sends `raw`: clamped if the codec clamps it.
constexpr std::int64_t taken(const Field& field, std::int64_t raw, const WireFormat& format) {
  if (field.beyond != Beyond::kClamped) return raw;
  const RawRange range = raw_range(field, format);
  return std::clamp(raw, range.min, range.max);
}

/// Reads the number of a field from DATA.
std::int64_t raw(const Field& field, const Payload& data);

/// Writes the number of a field to DATA. Pre: the number fits in the field.
void put(const Field& field, std::int64_t raw, Payload& data);

/// Converts a number on the wire to the unit of the field's key.
double quantity(const Field& field, std::int64_t raw, const WireFormat& format);
/// Converts a quantity to the nearest number that fits in the field. Pre: the scale is not kFlag or
/// kBridge, which only replies have.
std::int64_t raw_of(const Field& field, double quantity, const WireFormat& format);

}  // namespace lk::protocol
