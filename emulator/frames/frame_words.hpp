#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "emulator/frames/reply_values.hpp"
#include "protocol/frame.hpp"

namespace lk::emulator {

class Bus;

/// A frame for a person.
struct FrameWords {
  int id = 0;             // the drive that it is for or from; 0: several, or none
  std::string command;    // "9C", or the identifier of a command for several drives: "280"
  std::string_view name;  // "read state 2"; empty: nobody knows it
  std::vector<ReplyValue> quantities;
  std::string values;         // the same in words: "angle_deg 240, max_speed_dps 120"
  std::string_view mark;      // empty, "error", "unknown": what catches the eye
  std::string_view drawback;  // why it means nothing, if so: "wrong length"
};

/// The name of a command byte, or of the identifier of a command for several drives: "read state
/// 2"; empty: nobody knows it.
std::string_view asked_name(std::uint32_t asked, protocol::Framing framing);
/// "9C", "280".
std::string asked_text(std::uint32_t asked);

/// What is latched in an errorState, from bit 0 on: "under_voltage".
std::vector<std::string_view> error_words(unsigned errors);

/// Reads the frames of one bus as its drives and hosts do.
class FrameReader {
 public:
  explicit FrameReader(const BusConfig& bus);
  FrameWords query(const protocol::Frame& frame) const;
  FrameWords reply(const protocol::Frame& frame) const;

  /// Drives of `bus`, the one it was made for, are found elsewhere.
  void follow(const Bus& bus);
  /// What is known of the drive at this ID; null: there is none.
  const ReplyReader* reader_of(int id) const;

 private:
  /// Some drive that knows the identifier for several, or any; null: there is none.
  const ReplyReader* reader_of_several(std::uint32_t frame_id) const;

  std::vector<int> drives_;  // their configured IDs
  std::vector<ReplyReader> readers_;
};

}  // namespace lk::emulator
