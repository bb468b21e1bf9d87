#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "emulator/core/bus_config.hpp"
#include "protocol/codec.hpp"

namespace lk::emulator {

/// One quantity of a reply, in the unit that its name ends with.
struct ReplyValue {
  std::string_view name;  // "speed_dps"
  double value = 0;
  double period = 0;  // begins anew after so much; 0 = does not

  friend bool operator==(const ReplyValue&, const ReplyValue&) = default;
};

/// What replies mean where a servo is on the wire.
struct ReplyReader {
  explicit ReplyReader(const ServoConfig& servo);
  /// The quantities of a frame that the servo has sent; none when it is no reply of its kind.
  std::vector<ReplyValue> values(const protocol::Frame& frame) const;
  /// The quantities of `fields` in DATA, by their keys: what a host writes as the drive takes it.
  enum class By : std::uint8_t { kHost, kDrive };
  std::vector<ReplyValue> values(std::span<const protocol::Field> fields,
                                 const protocol::Payload& data, By by) const;
  /// A query with the command byte `asked` can have a reply with `said` in its place.
  bool answers_with(std::uint8_t asked, std::uint8_t said) const;

  int id;  // that it answers at
  protocol::WireFormat format;
  double encoder_counts;    // of the encoder field
  double circle_deg;        // of the single-turn angle
  bool manual_reply_bytes;  // Quirks
};

/// From `a` to `b` the short way round.
double value_difference(const ReplyValue& a, const ReplyValue& b);

/// "temperature_C 25, iq_A -0.5": for people.
std::string values_text(const std::vector<ReplyValue>& values);

}  // namespace lk::emulator
