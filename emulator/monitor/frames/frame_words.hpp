#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "emulator/monitor/frames/log_pairing.hpp"
#include "protocol/frame.hpp"

namespace lk::emulator {

class Bus;

/// A decoded frame for display.
struct FrameWords {
  int id = 0;             // drive; 0: several or none
  std::string command;    // "9C"; for several drives the identifier: "280"
  std::string_view name;  // "read state 2"; empty: unknown
  std::vector<ReplyValue> quantities;
  std::string values;        // as text: "angle_deg 240, max_speed_dps 120"
  std::string_view mark;     // highlight: empty, "error" or "unknown"
  std::string_view problem;  // why it is invalid: "wrong length"
};

/// Returns the name of a command byte, or of an identifier for several drives: "read state 2";
/// empty if unknown.
std::string_view command_name(std::uint32_t asked, protocol::Framing framing);
/// Returns a command byte or identifier in hexadecimal: "9C", "280".
std::string command_text(std::uint32_t asked);

/// Returns the bits set in errorState, from bit 0 on: "under_voltage".
std::vector<std::string_view> error_words(unsigned errors);

/// Decodes frames of one bus: queries as its drives do, replies as hosts do.
class FrameReader {
 public:
  explicit FrameReader(const BusConfig& bus);
  FrameWords query(const protocol::Frame& frame) const;
  FrameWords reply(const protocol::Frame& frame) const;

  /// Updates the addresses of the drives. Pre: `bus` is the bus of the constructor.
  void update_addresses(const Bus& bus);
  /// Returns the reader of the drive at this ID; null without such a drive.
  const ReplyReader* reader_of(int id) const;

 private:
  /// Returns the reader of a drive that knows this identifier for several drives. Without such a
  /// drive, returns any reader; null if the bus has no drives.
  const ReplyReader* reader_of_several(std::uint32_t frame_id) const;

  std::vector<int> drives_;  // configured IDs
  std::vector<ReplyReader> readers_;
};

}  // namespace lk::emulator
