#pragma once

/// @file Cases with hosts, for tests.

#include <poll.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <stdexcept>
#include <string>

#include "emulator/files/durable_file.hpp"
#include "tests/support/temp_directory.hpp"
#include "tools/campaign/hosts/run_host.hpp"

namespace lk::emulator::hosts_test {

using namespace std::chrono_literals;

inline HostSetup host(std::vector<std::string> command, const std::string& bus = "slcan-tcp") {
  HostSetup setup;
  setup.command = std::move(command);
  setup.bus = bus;
  setup.program = LKEMU_PROGRAM;
  return setup;
}
inline HostSetup shell(const std::string& script) { return host({"sh", "-c", script}); }

/// One drive that stands at 0 for a second.
inline HostCase quiet_case(std::uint64_t number = 0) {
  HostCase one;
  one.number = number;
  one.scenario_toml =
      "duration_s = 1\n[[expect]]\nsays = \"it stands\"\nid = 1\n"
      "signal = \"true_speed_dps\"\nmin = -10\nmax = 10\nfrom_s = 0.5\nto_s = 1\n";
  return one;
}

inline HostRun run(const HostSetup& setup, const HostCase& one) {
  auto run = run_host_case(setup, one);
  if (!run) throw std::runtime_error("it was stopped");
  return *std::move(run);
}

/// A process that may end at any time.
class Watched {
 public:
  explicit Watched(int pid) : fd_(static_cast<int>(::syscall(SYS_pidfd_open, pid, 0))) {}
  /// Whether it ends; waits for that.
  bool ends() const {
    constexpr int kPatience_ms = 60'000;
    pollfd end{fd_.get(), POLLIN, 0};
    return !fd_ || ::poll(&end, 1, kPatience_ms) == 1;
  }
  bool has_ended() const {
    pollfd end{fd_.get(), POLLIN, 0};
    return !fd_ || ::poll(&end, 1, 0) == 1;
  }

 private:
  Descriptor fd_;
};

}  // namespace lk::emulator::hosts_test
