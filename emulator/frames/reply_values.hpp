#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "emulator/core/bus_config.hpp"
#include "protocol/codec.hpp"

namespace lk::emulator {

/// One quantity of a reply; its unit is the suffix of its name.
struct ReplyValue {
  std::string_view name;  // "speed_dps"
  double value = 0;
  double period = 0;  // wraps around after this value; 0: never

  friend bool operator==(const ReplyValue&, const ReplyValue&) = default;
};

/// Decodes the replies of a servo.
struct ReplyReader {
  explicit ReplyReader(const ServoConfig& servo);
  /// Returns the values in a frame of the servo; empty if it is none of its replies.
  std::vector<ReplyValue> values(const protocol::Frame& frame) const;
  /// Returns the values of `fields` in DATA, by key; a host's values as the drive accepts them.
  enum class By : std::uint8_t { kHost, kDrive };
  std::vector<ReplyValue> values(std::span<const protocol::Field> fields,
                                 const protocol::Payload& data, By by) const;
  /// Returns true if a reply with byte `said` can answer the command byte `asked`.
  bool answers_with(std::uint8_t asked, std::uint8_t said) const;

  int id;  // ID at which it answers
  protocol::WireFormat format;
  double encoder_counts;    // of the encoder field
  double circle_deg;        // of the single-turn angle
  bool manual_reply_bytes;  // Quirks
};

/// Returns `b` − `a`, the short way around for a periodic value.
double value_difference(const ReplyValue& a, const ReplyValue& b);

/// Formats for display: "temperature_C 25, iq_A -0.5".
std::string values_text(const std::vector<ReplyValue>& values);

}  // namespace lk::emulator
