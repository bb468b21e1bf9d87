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
  double period = 0;  // the value wraps around at this number; 0: never

  friend bool operator==(const ReplyValue&, const ReplyValue&) = default;
};

/// Decodes the replies of a servo.
struct ReplyReader {
  explicit ReplyReader(const ServoConfig& servo);
  /// Returns the values in a reply of the servo; empty if the frame is not such a reply.
  std::vector<ReplyValue> values(const protocol::Frame& frame) const;
  /// Returns the values of `fields` in `data`, named by key. `by`: sender of the data. A host's
  /// values are returned as the drive uses them, for example clamped.
  enum class By : std::uint8_t { kHost, kDrive };
  std::vector<ReplyValue> values(std::span<const protocol::Field> fields,
                                 const protocol::Payload& data, By by) const;
  /// Returns true if a reply with byte `reply_command` can answer the command byte `asked`.
  bool answers_with(std::uint8_t asked, std::uint8_t reply_command) const;

  int id;  // ID at which it answers
  protocol::WireFormat format;
  double encoder_counts;    // period of encoder fields
  double circle_deg;        // period of the single-turn angle
  bool manual_reply_bytes;  // as Quirks::manual_reply_bytes
};

/// Returns `b` − `a`, the short way around for a periodic value.
double value_difference(const ReplyValue& a, const ReplyValue& b);

/// Formats for display: "temperature_C 25, iq_A -0.5".
std::string values_text(const std::vector<ReplyValue>& values);

/// Whether a frame can be the reply to a query. kEither: it can, but it can also be a query.
enum class Fit : std::uint8_t { kNo, kEither, kYes };

/// Returns whether `reply` can be the reply to `query`, ignoring the identifier of `reply`.
/// `command`: command byte of replies to `query`.
Fit reply_fit(const ReplyReader& reader, std::uint8_t command, const protocol::Frame& query,
              const protocol::Frame& reply);

/// Returns true for frames in the format of drives: on CAN, an 11-bit identifier and 8 bytes; on
/// RS-485, any packet.
bool is_data(const protocol::Frame& frame);

/// Returns false for a block command of LK-TECH's tool (docs/reference/rs485.md) with a length that
/// only queries have.
bool has_length_of_reply(const protocol::Frame& frame);

/// Returns true if the frame looks like a reply with the drive's state. On CAN, DATA[1] is then
/// above 1 (temperature), which hosts rarely send; on RS-485, the frame has 8 bytes.
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
  std::vector<TimedFrame> sent;     // frames of hosts and other devices, not of drives
  std::vector<Exchange> exchanges;  // in the order of their queries
  std::uint64_t ambiguous = 0;      // replies that may be queries, or that match several queries
  std::uint64_t orphans = 0;        // replies without a query in the log
  std::uint64_t unknown_drive_frames = 0;  // frames of or for drives without configuration; ignored
};

/// Time-out of a query (assumed; a drive answers within 1 ms).
inline constexpr SimTime kLongestReply = std::chrono::milliseconds(100);

/// Separates queries and replies. Pre: `log` is ordered by time. Uses separate reply identifiers or
/// directions if the log has them. Otherwise a frame is a reply if it can answer a pending query of
/// its drive (rules: docs/reference/formats.md).
PairedLog pair_log(const std::vector<LoggedFrame>& log, const BusConfig& bus);

}  // namespace lk::emulator
