#pragma once

#include <chrono>
#include <string>

namespace lk::emulator {

/// Limits log messages caused by others to twenty in ten seconds. Otherwise they could fill a disk,
/// or a log pipe that is not read, which would stop the program.
class TellLimit {
 public:
  /// Returns whether one more message may be logged. The first refusal is logged in the name of
  /// `whom`.
  bool may_tell(const std::string& whom);

 private:
  std::chrono::steady_clock::time_point since_;
  unsigned told_ = 0;
};

}  // namespace lk::emulator
