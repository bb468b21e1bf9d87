#pragma once

#include <functional>

#include "emulator/live/pacer.hpp"

namespace lk::emulator {

/// The kernel stamps frames with the wall clock; here the stamps become monotonic time. So the
/// stamp of a frame that has just come is as good as a reading of the clock, and costs no system
/// call. A wall clock that is set must not move the simulation: stamps that do not fit to what is
/// known are compared with both clocks anew.
class StampClock {
 public:
  struct Reading {
    std::chrono::nanoseconds wall;
    MonoTime mono;  // not earlier than `wall`: no frame seems older than it is
  };
  /// Both clocks, as close together as they can be had.
  static Reading read_clocks();

  explicit StampClock(std::function<Reading()> read = read_clocks) : read_(std::move(read)) {}

  /// A frame with this stamp has just been received, the newest there is, when monotonic time was
  /// known to have reached `seen`. Gives what it has reached now, at least.
  MonoTime reached(std::chrono::nanoseconds stamp, MonoTime seen);
  /// When the frame came; the time is `now`, at least.
  MonoTime arrival(std::chrono::nanoseconds stamp, MonoTime now) const;

  /// From `seen`, so far a stamp is believed.
  static constexpr MonoTime kBelievable = std::chrono::milliseconds(3);
  /// How long a comparison of the clocks holds.
  static constexpr MonoTime kHolds = std::chrono::seconds(1);
  /// A frame that claims to be older was stamped before the clock was set.
  static constexpr MonoTime kOldest = std::chrono::seconds(1);

 private:
  std::function<Reading()> read_;
  std::chrono::nanoseconds ahead_{0};  // of the wall clock
  MonoTime compared_ = MonoTime::min();
};

}  // namespace lk::emulator
