#pragma once

#include <optional>

#include "emulator/advice/advice.hpp"
#include "emulator/advice/heard.hpp"

namespace lk::emulator {

/// Queries that do not wait for the reply to the one before.
class WaitWatch {
 public:
  /// In a row. Hosts that send a handful of queries and then read the replies are common, and
  /// drives take that: they hold 16 replies (docs/protocol.md §5).
  static constexpr int kInARow = 20;

  std::optional<Finding> hear(const Heard& heard, const KnownDrive& drive);

 private:
  std::optional<SimTime> last_;
  int in_a_row_ = 0;
};

/// Pauses that nearly, or already, make the protection against lost input trip.
class InputWatch {
 public:
  static constexpr double kNear = 0.8;  // of the time it takes (assumed)
  static constexpr double kGone = 3;    // the host was not there (assumed)
  static constexpr int kPauses = 3;     // one may be an accident (assumed)

  std::optional<Finding> hear(const Heard& heard, const KnownDrive& drive);

 private:
  std::optional<SimTime> last_;
  int pauses_ = 0;
};

}  // namespace lk::emulator
