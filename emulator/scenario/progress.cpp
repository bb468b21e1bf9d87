#include "emulator/scenario/progress.hpp"

#include <cstdio>
#include <utility>

namespace lk::emulator {
namespace {

using Clock = std::chrono::steady_clock;
constexpr auto kPatience = std::chrono::seconds(1);
constexpr auto kStep = std::chrono::milliseconds(200);

double seconds(std::chrono::nanoseconds time) {
  return std::chrono::duration<double>(time).count();
}

}  // namespace

Progress::Progress(std::string name, SimTime duration, bool wanted)
    : name_(std::move(name)),
      duration_(duration),
      wanted_(wanted),
      began_(Clock::now()),
      next_(began_ + kPatience) {}

Progress::~Progress() {
  if (shown_) std::fputs("\r\x1b[K", stderr);
}

double Progress::wall_s() const { return seconds(Clock::now() - began_); }

void Progress::show(SimTime now) {
  if (!wanted_ || Clock::now() < next_) return;
  next_ = Clock::now() + kStep;
  shown_ = true;
  const double speed = seconds(now) / wall_s();
  const double part = seconds(now) / seconds(duration_);
  constexpr int kWidth = 20;
  const int full = static_cast<int>(part * kWidth);
  std::fprintf(stderr, "\r\x1b[K%s [%.*s%*s] %.1f of %.1f s, %.1f x real time, %.0f s to go",
               name_.c_str(), full, "====================", kWidth - full, "", seconds(now),
               seconds(duration_), speed, speed > 0 ? seconds(duration_ - now) / speed : 0.0);
  std::fflush(stderr);
}

}  // namespace lk::emulator
