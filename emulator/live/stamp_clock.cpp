#include "emulator/live/stamp_clock.hpp"

#include <algorithm>
#include <ctime>

namespace lk::emulator {
namespace {

std::chrono::nanoseconds wall_now() {
  timespec now{};
  ::clock_gettime(CLOCK_REALTIME, &now);
  return std::chrono::seconds(now.tv_sec) + std::chrono::nanoseconds(now.tv_nsec);
}

}  // namespace

StampClock::Reading StampClock::read_clocks() {
  constexpr int kTries = 3;  // in case the process is delayed in between
  constexpr MonoTime kClose = std::chrono::microseconds(50);
  Reading best{};
  MonoTime best_gap = MonoTime::max();
  MonoTime before = monotonic_now();
  for (int n = 0; n < kTries && best_gap > kClose; ++n) {
    const std::chrono::nanoseconds wall = wall_now();
    const MonoTime mono = monotonic_now();
    if (mono - before < best_gap) {
      best = {wall, mono};
      best_gap = mono - before;
    }
    before = mono;
  }
  return best;
}

MonoTime StampClock::reached(std::chrono::nanoseconds stamp, MonoTime seen) {
  const MonoTime mono = stamp - ahead_;
  const bool holds = compared_ != MonoTime::min() && mono - compared_ < kHolds;
  if (holds && mono >= seen - kBelievable && mono <= seen + kBelievable) {
    return std::max(mono, seen);
  }
  const Reading now = read_();
  ahead_ = now.wall - now.mono;
  compared_ = now.mono;
  return std::max(now.mono, seen);
}

MonoTime StampClock::arrival(std::chrono::nanoseconds stamp, MonoTime now) const {
  const MonoTime mono = stamp - ahead_;
  return mono > now || now - mono > kOldest ? now : mono;
}

}  // namespace lk::emulator
