#pragma once

#include <array>
#include <csignal>

namespace lk::emulator {

/// For as long as this lives, SIGINT and SIGTERM do not end the program but are noted: what is
/// under way comes to its end. The second one ends it at once.
class Interruptible {
 public:
  Interruptible();
  Interruptible(const Interruptible&) = delete;
  Interruptible& operator=(const Interruptible&) = delete;
  ~Interruptible();

 private:
  static constexpr std::array<int, 2> kSignals = {SIGINT, SIGTERM};
  std::array<void (*)(int), 2> before_{};
};

/// One of them has come.
bool interrupted();
/// A descriptor that can be read from then on.
int interruption();

}  // namespace lk::emulator
