#pragma once

/// @file What candump prints, whatever its options: a log (-L, -l), or what a terminal gets, with
/// time stamps (-t) or without, with directions (-x), with characters (-a), in colour (-c).

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "emulator/config/candump_log.hpp"

namespace lk::emulator {

/// A frame as candump shows it. `line.at` is what the stamp says, 0 without one.
struct ShownFrame {
  CandumpLine line;
  bool has_stamp = false;
  bool may_be_step = false;  // a stamp as -t d and -t z print it
};

/// A line that goes on about the error frame before it (-e), or is empty.
struct NothingShown {};

/// One line without its end, or what is wrong with it: safe to print, and in ASCII.
std::variant<ShownFrame, NothingShown, std::string> parse_candump_text(std::string_view line);

/// The machine that logs is the host; none where the log does not say.
std::optional<bool> from_host(CandumpLine::Direction direction);

/// Turns stamps into times. `-t d` prints steps, and looks like `-t z` until a stamp is before the
/// one that its interface had last.
class StampReader {
 public:
  /// None: the frame has no stamp.
  std::optional<SimTime> time_of(const ShownFrame& frame);
  bool steps() const { return steps_; }

 private:
  std::map<std::string, SimTime> last_;  // stamp, by interface, until it is known what they are
  SimTime sum_{0};
  bool steps_ = false;
};

/// Longer ones are none of candump's: 64 bytes of CAN FD with all options take less than 400.
inline constexpr std::size_t kLongestCandumpLine = 1024;

}  // namespace lk::emulator
