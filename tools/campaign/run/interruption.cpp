#include "tools/campaign/run/interruption.hpp"

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include "emulator/ground/start_error.hpp"

namespace lk::emulator {
namespace {

/// A pipe that the signal writes to; open for as long as the program runs.
const std::array<int, 2>& pipe_ends() {
  static const std::array<int, 2> ends = [] {
    std::array<int, 2> made{};
    if (::pipe2(made.data(), O_CLOEXEC | O_NONBLOCK) != 0) throw StartError("no pipe is left");
    return made;
  }();
  return ends;
}

void note(int signal) {
  std::signal(signal, SIG_DFL);
  [[maybe_unused]] const auto written = ::write(pipe_ends()[1], "!", 1);
}

}  // namespace

Interruptible::Interruptible() {
  pipe_ends();
  for (std::size_t n = 0; n < kSignals.size(); ++n) before_[n] = std::signal(kSignals[n], note);
}

Interruptible::~Interruptible() {
  for (std::size_t n = 0; n < kSignals.size(); ++n) std::signal(kSignals[n], before_[n]);
}

bool interrupted() {
  pollfd wait{interruption(), POLLIN, 0};
  return ::poll(&wait, 1, 0) > 0;
}

int interruption() { return pipe_ends()[0]; }

}  // namespace lk::emulator
