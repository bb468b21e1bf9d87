#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <cstdint>
#include <functional>

#include "emulator/sim_time.hpp"

namespace lk::emulator {

/// Reading of CLOCK_MONOTONIC.
using MonoTime = std::chrono::nanoseconds;
MonoTime monotonic_now();

/// Simulated time is monotonic time since the start, as long as the machine keeps up. When it does
/// not, or was stopped, time slips: the simulation goes on from where it is instead of sprinting
/// after. All its readings are whole microseconds, so that what a log writes in microseconds is
/// exact.
class SimClock {
 public:
  static constexpr SimTime kMostLag = std::chrono::milliseconds(50);

  explicit SimClock(MonoTime start) : epoch_(start) {}

  struct Reading {
    SimTime now;
    SimTime slipped;  // by this reading; mostly 0
  };
  /// Simulated time at `mono` for a simulation that has got as far as `reached`.
  Reading read(MonoTime mono, SimTime reached);
  MonoTime to_mono(SimTime time) const {
    return epoch_ + std::chrono::ceil<std::chrono::microseconds>(time);
  }

  SimTime total_slip() const { return total_slip_; }
  std::uint64_t slips() const { return slips_; }

 private:
  MonoTime epoch_;
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
  /// Wakes at `mono`, or earlier if that was asked for before: one wake-up too many is cheaper than
  /// a system call for each frame.
  void wake_by(MonoTime mono);

 private:
  void wait();

  boost::asio::posix::stream_descriptor timer_;
  std::function<void()> on_wake_;
  bool armed_ = false;
  MonoTime armed_at_{0};
};

}  // namespace lk::emulator
