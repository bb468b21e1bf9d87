#pragma once

/// @file Output of candump with any option: a log (-L, -l) or terminal output. The latter has time
/// stamps (-t), directions (-x), characters (-a) or colours (-c).

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "emulator/config/candump_log.hpp"

namespace lk::emulator {

/// A frame as shown by candump. `line.at` is its stamp; 0 without one.
struct PrintedFrame {
  CandumpLine line;
  bool has_stamp = false;
  bool may_be_step = false;  // stamp in the form of -t d and -t z
};

/// An empty line, or one that continues the previous error frame (-e).
struct NoFrame {};

/// Parses a line without its end. An error text is safe to print, in ASCII.
std::variant<PrintedFrame, NoFrame, std::string> parse_candump_text(std::string_view line);

/// The logging machine counts as the host; nullopt if the log has no directions.
std::optional<bool> from_host(CandumpLine::Direction direction);

/// Converts stamps to times. `-t d` prints differences. It looks like `-t z` until a stamp is below
/// the previous one of its interface.
class StampReader {
 public:
  /// Returns nullopt if the frame has no stamp.
  std::optional<SimTime> time_of(const PrintedFrame& frame);
  bool steps() const { return steps_; }

 private:
  std::map<std::string, SimTime> last_;  // by interface, while their kind is unknown
  SimTime sum_{0};
  bool steps_ = false;
};

/// A longer line is not from candump: 64 bytes of CAN FD with all options take less than 400.
inline constexpr std::size_t kLongestCandumpLine = 1024;

}  // namespace lk::emulator
