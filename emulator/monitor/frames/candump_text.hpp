#pragma once

/// @file Parses output of candump with any option: a log (-L, -l) or terminal output. The latter
/// may have time stamps (-t), directions (-x), characters (-a) and colours (-c).

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "emulator/config/candump_log.hpp"

namespace lk::emulator {

/// A frame as printed by candump. `line.at` is its time stamp; 0 without a stamp.
struct PrintedFrame {
  CandumpLine line;
  bool has_stamp = false;
  bool may_be_step = false;  // the stamp has the form that -t d (differences) and -t z share
};

/// An empty line, or a line that continues the previous error frame (-e).
struct NoFrame {};

/// Parses a line, given without its newline. The string is an error text of printable ASCII.
std::variant<PrintedFrame, NoFrame, std::string> parse_candump_text(std::string_view line);

/// Returns true if the logging machine, which counts as the host, sent the frame; nullopt if the
/// direction is unknown.
std::optional<bool> from_host(CandumpLine::Direction direction);

/// Converts stamps to times. `-t d` prints the time since the previous frame, in the same form as
/// the times of `-t z`. A stamp below the previous one of its interface shows that it is `-t d`.
class StampReader {
 public:
  /// Returns nullopt if the frame has no stamp.
  std::optional<SimTime> time_of(const PrintedFrame& frame);
  /// Returns true once the stamps are known to be differences (-t d).
  bool steps() const { return steps_; }

 private:
  std::map<std::string, SimTime> last_;  // last stamp by interface, until `steps_`
  SimTime sum_{0};                       // of the stamps so far
  bool steps_ = false;
};

/// In characters. A longer line is not from candump: a CAN FD frame of 64 bytes with all options
/// takes less than 400.
inline constexpr std::size_t kLongestCandumpLine = 1024;

}  // namespace lk::emulator
