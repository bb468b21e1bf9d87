#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "emulator/core/sim_time.hpp"

namespace lk::emulator {

/// Reading of CLOCK_MONOTONIC.
using MonoTime = std::chrono::nanoseconds;
MonoTime monotonic_now();

/// How simulated time goes by.
struct ClockMode {
  bool stepped = false;  // it stands still, and moves when it is told to
  double factor = 1;     // else: so many times as fast as monotonic time

  friend bool operator==(const ClockMode&, const ClockMode&) = default;
};
inline constexpr double kSlowestClock = 0.001;
inline constexpr double kFastestClock = 1000;
/// "realtime", "x10", "stepped"; none: it is no clock's name.
std::optional<ClockMode> parse_clock_mode(std::string_view text);
std::string to_string(const ClockMode& mode);

/// Simulated time follows monotonic time, as long as the machine keeps up. When it does not, or was
/// stopped, time slips: the simulation goes on from where it is instead of sprinting after. All its
/// readings are whole microseconds, so that what a log writes in microseconds is exact.
class SimClock {
 public:
  /// Of monotonic time: a slip is what a person would notice, however fast time goes.
  static constexpr MonoTime kMostLag = std::chrono::milliseconds(50);

  explicit SimClock(MonoTime start, ClockMode mode = {}) : mode_(mode), epoch_(start) {}

  struct Reading {
    SimTime now;
    SimTime slipped;  // by this reading; mostly 0
  };
  /// Simulated time at `mono` for a simulation that has got as far as `reached`.
  Reading read(MonoTime mono, SimTime reached);
  /// Simulated time at `mono`, whoever has got as far.
  SimTime shows(MonoTime mono) const;
  /// When simulated time will be `time`; far away when it stands still.
  MonoTime to_mono(SimTime time) const;
  /// How much simulated time goes by meanwhile.
  SimTime span(MonoTime wall) const;

  const ClockMode& mode() const { return mode_; }
  /// Goes on from `at`, where simulated time is at `mono`.
  void switch_to(ClockMode mode, MonoTime mono, SimTime at);
  /// Of a stepped clock: it shows this now.
  void step_to(SimTime at) { base_ = at; }
  SimTime stands_at() const { return base_; }

  SimTime total_slip() const { return total_slip_; }
  std::uint64_t slips() const { return slips_; }

 private:
  ClockMode mode_;
  MonoTime epoch_;
  SimTime base_{0};  // simulated time at `epoch_`
  SimTime total_slip_{0};
  std::uint64_t slips_ = 0;
};

/// Tells slips apart from an episode of slipping, which is reported once when it begins and once
/// when it is over.
class SlipReporter {
 public:
  void slipped(MonoTime mono, SimTime by);
  /// Call now and then.
  void check(MonoTime mono);

 private:
  SimTime episode_{0};  // slipped in this episode; 0: there is none
  MonoTime last_{0};
};

/// An alarm clock on the loop, with the kernel's resolution (Asio's own timers round up to 1 ms on
/// epoll).
class WakeTimer {
 public:
  WakeTimer(boost::asio::io_context& loop, std::function<void()> on_wake);
  /// Wakes at `mono`, or earlier if that was asked for before and is not over `now`: one wake-up
  /// too many is cheaper than a system call for each frame.
  void wake_by(MonoTime mono, MonoTime now);

 private:
  void wait();

  boost::asio::posix::stream_descriptor timer_;
  std::function<void()> on_wake_;
  bool armed_ = false;
  MonoTime armed_at_{0};
};

}  // namespace lk::emulator
