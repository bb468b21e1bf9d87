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

/// Speed of simulated time.
struct ClockMode {
  bool stepped = false;  // time stands still except during World::advance
  double factor = 1;     // otherwise: multiple of monotonic time

  friend bool operator==(const ClockMode&, const ClockMode&) = default;
};
inline constexpr double kSlowestClock = 0.001;
inline constexpr double kFastestClock = 1000;
/// Parses "realtime", "x10" (factor) or "stepped"; nullopt if the text is none of these.
std::optional<ClockMode> parse_clock_mode(std::string_view text);
std::string to_string(const ClockMode& mode);

/// Simulated time follows monotonic time while the machine keeps up. If the machine is late or was
/// stopped, time slips: the simulation continues from where it is and does not catch up. All
/// readings are whole microseconds, so that log times are exact.
class SimClock {
 public:
  /// The clock slips if the simulation lags more, in monotonic time at any speed of the clock: a
  /// person would notice the delay.
  static constexpr MonoTime kMaxLag = std::chrono::milliseconds(50);

  explicit SimClock(MonoTime start, ClockMode mode = {}) : mode_(mode), epoch_(start) {}

  struct Reading {
    SimTime now;
    SimTime slipped;  // how far this call of `read` set the clock back; mostly 0
  };
  /// Returns the time at `mono`; slips back to `reached`, the time of the simulation, if that is
  /// more than kMaxLag behind.
  Reading read(MonoTime mono, SimTime reached);
  /// Returns the time at `mono` without checking for a slip.
  SimTime time_at(MonoTime mono) const;
  /// Returns when simulated time will be `time`; MonoTime::max() if the clock is stepped.
  MonoTime to_mono(SimTime time) const;
  /// Converts a duration of monotonic time to simulated time.
  SimTime span(MonoTime wall) const;

  const ClockMode& mode() const { return mode_; }
  /// Changes the mode at `mono`, when simulated time is `at`.
  void switch_to(ClockMode mode, MonoTime mono, SimTime at);
  /// Pre: the clock is stepped. Sets its time to `at`.
  void step_to(SimTime at) { base_ = at; }
  SimTime stepped_time() const { return base_; }

  SimTime total_slip() const { return total_slip_; }
  std::uint64_t slips() const { return slips_; }

 private:
  ClockMode mode_;
  MonoTime epoch_;
  SimTime base_{0};  // simulated time at `epoch_`
  SimTime total_slip_{0};
  std::uint64_t slips_ = 0;
};

/// Groups slips into episodes; logs the start and the end of each episode.
class SlipReporter {
 public:
  void slipped(MonoTime mono, SimTime by);
  /// Ends an episode after a second without a slip. Call regularly.
  void check(MonoTime mono);

 private:
  SimTime episode_{0};  // sum of the slips in this episode; 0: no episode
  MonoTime last_{0};
};

/// A timer on the loop with the kernel's resolution (Asio's timers round up to 1 ms on epoll).
class WakeTimer {
 public:
  WakeTimer(boost::asio::io_context& loop, std::function<void()> on_wake);
  /// Wakes at `mono`, or earlier if a wake-up between `now` and `mono` is already set. An extra
  /// wake-up is cheaper than a system call for each frame.
  void wake_by(MonoTime mono, MonoTime now);

 private:
  void wait();

  boost::asio::posix::stream_descriptor timer_;
  std::function<void()> on_wake_;
  bool armed_ = false;
  MonoTime armed_at_{0};
};

/// Converts the kernel's stamps of frames from wall clock to monotonic time. The stamp of a new
/// frame replaces a reading of the clock and saves a system call. Setting the wall clock must not
/// move the simulation: an implausible stamp makes this class compare both clocks again.
class StampClock {
 public:
  struct Reading {
    std::chrono::nanoseconds wall;
    MonoTime mono;  // read after `wall`: no frame seems older than it is
  };
  /// Reads both clocks as close together as possible.
  static Reading read_clocks();

  explicit StampClock(std::function<Reading()> read = read_clocks) : read_(std::move(read)) {}

  /// Returns a lower bound of the present monotonic time, at least `seen`. `stamp`: of the newest
  /// frame, just received; `seen`: latest monotonic time known so far.
  MonoTime reached(std::chrono::nanoseconds stamp, MonoTime seen);
  /// Converts a frame's stamp to the monotonic time of its arrival, at most `now`. Returns `now`
  /// for a stamp older than kOldest.
  MonoTime arrival(std::chrono::nanoseconds stamp, MonoTime now) const;

  /// Largest distance of a plausible stamp from `seen`, before or after it.
  static constexpr MonoTime kBelievable = std::chrono::milliseconds(3);
  /// Time after which `reached` compares both clocks again.
  static constexpr MonoTime kHolds = std::chrono::seconds(1);
  /// Age above which a stamp counts as made before the wall clock was set.
  static constexpr MonoTime kOldest = std::chrono::seconds(1);

 private:
  std::function<Reading()> read_;
  std::chrono::nanoseconds ahead_{0};    // wall clock minus monotonic time
  MonoTime compared_ = MonoTime::min();  // last comparison
};

}  // namespace lk::emulator
