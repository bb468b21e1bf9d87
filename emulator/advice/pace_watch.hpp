#pragma once

#include <optional>

#include "emulator/advice/advice.hpp"
#include "emulator/advice/heard.hpp"

namespace lk::emulator {

/// Detects queries that do not wait for the previous reply.
class WaitWatch {
 public:
  /// Consecutive queries. Many hosts send a few queries and then read the replies, which drives
  /// allow: they queue 16 replies (docs/protocol.md §5).
  static constexpr int kInARow = 20;

  std::optional<Finding> hear(const Heard& heard, const KnownDrive& drive);

 private:
  std::optional<SimTime> last_;
  int in_a_row_ = 0;
};

/// Detects pauses that trip, or nearly trip, the lost-input protection.
class InputWatch {
 public:
  static constexpr double kNear = 0.8;  // share of the trip time (assumed)
  static constexpr double kGone = 3;    // multiple of it: the host was absent (assumed)
  static constexpr int kPauses = 3;     // fewer may be accidents (assumed)

  std::optional<Finding> hear(const Heard& heard, const KnownDrive& drive);

 private:
  std::optional<SimTime> last_;
  int pauses_ = 0;
};

}  // namespace lk::emulator
