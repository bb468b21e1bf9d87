#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "emulator/core/bus_config.hpp"
#include "emulator/core/sim_time.hpp"
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
  /// Returns true if a reply with byte `reply_command` can answer the command byte `asked`.
  bool answers_with(std::uint8_t asked, std::uint8_t reply_command) const;

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

/// Whether a frame can be the reply to a query; kEither: it can also be a query.
enum class Fit : std::uint8_t { kNo, kEither, kYes };

/// `command`: DATA[0] of the reply to `query`. The identifier of `reply` is ignored.
Fit reply_fit(const ReplyReader& reader, std::uint8_t command, const protocol::Frame& query,
              const protocol::Frame& reply);

/// Returns true for frames in the format of drives: 11-bit identifier, 8 bytes.
bool is_data(const protocol::Frame& frame);

/// Returns false for a block of the tool (docs/reference/rs485.md) with a length that only queries
/// have.
bool has_length_of_reply(const protocol::Frame& frame);

/// Returns true for a state with a temperature in DATA[1], which hosts rarely send.
bool looks_like_a_state(const protocol::Frame& frame);

/// A frame of a log, with its direction if the log has it.
struct LoggedFrame {
  TimedFrame timed;
  std::optional<bool> from_host;
  int line = 0;  // line number in the log, from 1; 0: none
};

/// A query to one drive and its reply. A frame for several drives is one query to each drive that
/// answers it.
struct Exchange {
  int id = 1;
  std::size_t query = 0;     // index in PairedLog::sent
  std::uint8_t command = 0;  // DATA[0] of the reply
  std::optional<TimedFrame> reply;
};

/// A log with queries and replies separated.
struct PairedLog {
  std::vector<TimedFrame> sent;            // from hosts and other devices
  std::vector<Exchange> exchanges;         // in the order of their queries
  std::uint64_t ambiguous = 0;             // frames that may have the other role
  std::uint64_t orphans = 0;               // replies without a query in the log
  std::uint64_t unknown_drive_frames = 0;  // frames of drives that are not in the robot; ignored
};

/// Time-out of a query (assumed; a drive answers within 1 ms).
inline constexpr SimTime kLongestReply = std::chrono::milliseconds(100);

/// Separates queries and replies. Pre: `log` is ordered by time. Uses separate reply identifiers or
/// directions if the log has them. Otherwise a frame is a reply if it can answer a pending query of
/// its drive (rules: docs/reference/formats.md).
PairedLog pair_log(const std::vector<LoggedFrame>& log, const BusConfig& bus);

}  // namespace lk::emulator
