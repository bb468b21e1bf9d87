#pragma once

#include <functional>

#include "emulator/live/pacer.hpp"

namespace lk::emulator {

/// Converts the kernel's stamps of frames from wall clock to monotonic time. The stamp of a new
/// frame replaces a reading of the clock and saves a system call. Setting the wall clock must not
/// move the simulation: an implausible stamp makes this class compare both clocks again.
class StampClock {
 public:
  struct Reading {
    std::chrono::nanoseconds wall;
    MonoTime mono;  // not earlier than `wall`: no frame seems older than it is
  };
  /// Reads both clocks as close together as possible.
  static Reading read_clocks();

  explicit StampClock(std::function<Reading()> read = read_clocks) : read_(std::move(read)) {}

  /// Returns the monotonic time that is reached at least. `stamp`: of the newest frame, just
  /// received; `seen`: the monotonic time known before.
  MonoTime reached(std::chrono::nanoseconds stamp, MonoTime seen);
  /// Returns when the frame came, at most `now`.
  MonoTime arrival(std::chrono::nanoseconds stamp, MonoTime now) const;

  /// Largest distance of a plausible stamp from `seen`.
  static constexpr MonoTime kBelievable = std::chrono::milliseconds(3);
  /// How long a comparison of the clocks is valid.
  static constexpr MonoTime kHolds = std::chrono::seconds(1);
  /// A frame with an older stamp was stamped before the clock was set.
  static constexpr MonoTime kOldest = std::chrono::seconds(1);

 private:
  std::function<Reading()> read_;
  std::chrono::nanoseconds ahead_{0};  // wall clock minus monotonic time
  MonoTime compared_ = MonoTime::min();
};

}  // namespace lk::emulator
