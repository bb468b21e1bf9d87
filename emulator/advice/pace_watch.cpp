#include "emulator/advice/pace_watch.hpp"

#include <algorithm>
#include <utility>

namespace lk::emulator {
namespace {

// clang-format off
constexpr Words kTooSoon{"{1} queries in a row without waiting: this one came {2} µs after the one before, whose reply takes at least {3} µs",
                         "连续 {1} 条命令帧不等回复：这一条在上一条之后 {2} µs 就来了，而上一条的回复至少要 {3} µs"};
constexpr Words kPause{"nothing for {1} ms; lost input trips after {2} ms",
                       "{1} ms 没有任何帧；{2} ms 后输入丢失保护就会动作"};
// clang-format on

double ms(SimTime time) { return std::chrono::duration<double, std::milli>(time).count(); }

}  // namespace

std::optional<Finding> WaitWatch::hear(const Heard& heard, const KnownDrive& drive) {
  const std::optional<SimTime> before = std::exchange(last_, heard.at);
  if (!before) return std::nullopt;
  const SimTime gap = heard.at - *before;
  // Equal times: the clock stood still or slipped, and the real gap is unknown.
  if (gap == SimTime{0}) return std::nullopt;
  in_a_row_ = gap < drive.shortest_answer ? std::min(in_a_row_ + 1, kInARow) : 0;
  if (in_a_row_ < kInARow) return std::nullopt;
  return Finding{AdviceKind::kNotWaited,
                 &kTooSoon,
                 {double{kInARow}, 1000 * ms(gap), 1000 * ms(drive.shortest_answer)}};
}

std::optional<Finding> InputWatch::hear(const Heard& heard, const KnownDrive& drive) {
  const std::optional<SimTime> before = std::exchange(last_, heard.at);
  if (!before || !drive.input_window) return std::nullopt;
  const double pause_ms = ms(heard.at - *before);
  const double window_ms = ms(*drive.input_window);
  if (pause_ms < kNear * window_ms || pause_ms > kGone * window_ms) return std::nullopt;
  pauses_ = std::min(pauses_ + 1, kPauses);
  if (pauses_ < kPauses) return std::nullopt;
  return Finding{AdviceKind::kInputWindow, &kPause, {pause_ms, window_ms}};
}

}  // namespace lk::emulator
