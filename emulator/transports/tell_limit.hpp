#pragma once

#include <chrono>
#include <string>

namespace lk::emulator {

/// Of what others bring about, the log tells twenty times in ten seconds: so none of them fills a
/// disk, or the pipe of a log that is not read, which would stop the program.
class TellLimit {
 public:
  /// Whether the log may tell once more. The first time that it may not, it says so, in the name of
  /// `whom`.
  bool may_tell(const std::string& whom);

 private:
  std::chrono::steady_clock::time_point since_;
  unsigned told_ = 0;
};

}  // namespace lk::emulator
