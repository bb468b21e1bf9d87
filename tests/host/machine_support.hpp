#pragma once

/// @file A directory, an emulator with a control socket in it, and hosts, for tests of machine
/// problems.

#include <gtest/gtest.h>

#include <chrono>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "tests/host/control_client.hpp"
#include "tests/host/emulator_process.hpp"
#include "tests/host/host.hpp"
#include "tests/support/temp_directory.hpp"

namespace lk::host {

using MonoClock = std::chrono::steady_clock;

inline constexpr Payload kReadState2 = {0x9C};

class MachineTest : public testing::Test {
 protected:
  explicit MachineTest(std::string bus = own_bus()) : bus_(std::move(bus)) {}

  std::string path(const std::string& name) const { return own_.path(name); }
  std::string socket() const { return path("s"); }
  std::vector<std::string> arguments(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> all = {"--rom", ":memory:", "--control", socket(),
                                    "--bus", bus_,       "--ids",     "1-4"};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  Answer get(const std::string& what) const { return ask(socket(), "GET " + what); }

  /// Simulated and slipped time, between two readings of the monotonic clock.
  struct Reading {
    MonoClock::time_point before, after;
    double sum_s = 0, slipped_s = 0;
  };
  Reading read_clock() const {
    Reading reading;
    reading.before = MonoClock::now();
    const Answer answer = get("/clock");
    reading.after = MonoClock::now();
    reading.slipped_s = answer.number("slipped_s");
    reading.sum_s = answer.number("time_s") + reading.slipped_s;
    return reading;
  }
  /// Checks that simulated time advanced like monotonic time. Either reading may lag by the time
  /// that the emulator makes up for before time slips, 50 ms.
  static void expect_no_drift(const Reading& begin, const Reading& end) {
    constexpr double kMaxLag_s = 0.051;
    const auto s = [](auto span) { return std::chrono::duration<double>(span).count(); };
    EXPECT_GE(end.sum_s - begin.sum_s, s(end.before - begin.after) - kMaxLag_s);
    EXPECT_LE(end.sum_s - begin.sum_s, s(end.after - begin.before) + kMaxLag_s);
  }

  /// Checks that all counters add up with `sent` frames of hosts. Pre: no frame is pending.
  void expect_balanced(std::uint64_t sent) const {
    const Answer status = get("/status");
    const auto count = [&](const char* key) {
      return static_cast<std::uint64_t>(status.number(key));
    };
    // By name, since the answer has other objects with numbers.
    std::uint64_t dropped = 0;
    for (const char* cause :
         {"error_frame", "CAN_FD_frame", "remote_request", "extended_identifier",
          "foreign_identifier", "no_such_drive", "wrong_length", "unknown_command", "wrong_mode",
          "drive_without_power", "drive_busy", "injected_fault", "queue_full"}) {
      dropped += count(cause);
    }
    EXPECT_EQ(sent, count("frames") + count("kernel_drops")) << status.body;
    EXPECT_EQ(count("frames"), count("queries") + dropped + count("frames_waiting")) << status.body;
    EXPECT_EQ(count("replies") + count("error_frames"),
              count("sent") + count("pending") + count("lost_link_down") +
                  count("lost_queue_full") + count("lost_replies"))
        << status.body;
    // Without multi-drive commands each query has one answer.
    const Answer drives = get("/drives");
    EXPECT_EQ(drives.sum("replies"), drives.sum("queries")) << drives.body;
    EXPECT_EQ(drives.sum("queries"), status.number("queries")) << drives.body;
  }

  const std::string bus_;
  const test::TempDirectory own_;
  const std::string directory_ = own_.path().string();
};

/// Returns whether the test has its own kernel, whose clock and scheduler it may disturb.
inline bool in_user_mode_linux() {
  return text_of("/proc/cpuinfo").find("User Mode Linux") != std::string::npos;
}

/// Waits for the condition; returns false on time-out.
template <class Condition>
bool wait_until(Condition condition) {
  const auto deadline = MonoClock::now() + std::chrono::milliseconds(kPatience_ms);
  while (!condition()) {
    if (MonoClock::now() >= deadline) return false;
  }
  return true;
}

/// Stops the program until SIGCONT; returns true once it has stopped.
inline bool suspend(const EmulatorProcess& emulator) {
  emulator.signal(SIGSTOP);
  return wait_until([&] {
    const std::string stat = text_of("/proc/" + std::to_string(emulator.pid()) + "/stat");
    const auto name_end = stat.rfind(')');
    return name_end != std::string::npos && stat[name_end + 2] == 'T';
  });
}

}  // namespace lk::host
