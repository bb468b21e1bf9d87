#include "emulator/advice/answer_watch.hpp"

#include <algorithm>
#include <utility>

#include "protocol/command_info.hpp"

namespace lk::emulator {
namespace {

// clang-format off
constexpr Words kNoAnswer{"{1} queries in a row without an answer, within {2} s",
                          "连续 {1} 条命令帧没有回复，历时 {2} s"};
constexpr Words kTooEarly{"{1} times a query {2} ms after the one before, whose reply came all the same; through this adapter it may take {3} ms",
                          "有 {1} 次在上一条之后 {2} ms 就发了命令帧，而回复还是到了；经过这个适配器最多要 {3} ms"};
// clang-format on

/// A query has 0 where a reply has a temperature, or the value that was asked for.
bool is_reply(const protocol::Frame& frame) {
  if (protocol::has_state(frame.data[0])) return frame.data[1] != 0;
  const protocol::CommandInfo* const command = protocol::find_command(frame.data[0]);
  const bool asks = command != nullptr && command->query.empty() && !command->echoed;
  return asks && std::any_of(frame.data.begin() + 1, frame.data.end(),
                             [](std::uint8_t byte) { return byte != 0; });
}

}  // namespace

std::optional<Finding> DeadWatch::hear(const TimedFrame& in, int id) {
  Polled& polled = polled_[static_cast<std::size_t>(id)];
  polled.elsewhere = polled.elsewhere || is_reply(in.frame);
  const bool alone = std::exchange(asked_last_, id) == id;
  if (polled.elsewhere) return std::nullopt;
  if (polled.in_a_row == 0 || in.at - polled.last > kPause || alone) {
    polled.since = in.at;
    polled.in_a_row = 0;
  }
  polled.last = in.at;
  polled.in_a_row = std::min(polled.in_a_row + 1, kInARow + 1);
  if (polled.in_a_row <= kInARow || in.at - polled.since < kLong) return std::nullopt;
  return Finding{AdviceKind::kPollsDead, &kNoAnswer, {double{kInARow}, in_s(in.at - polled.since)}};
}

void DeadWatch::hear_reply(int id) { polled_[static_cast<std::size_t>(id)].in_a_row = 0; }

std::optional<Finding> TimeoutWatch::hear(const Heard& heard, const KnownDrive& drive) {
  if (drive.adapter_worst == SimTime{0}) return std::nullopt;
  const SimTime gap = heard.at - std::exchange(last_, heard.at);
  const SimTime worst = drive.shortest_answer + drive.adapter_worst;
  if (gap > worst) waiting_ = 0;  // the previous reply is lost
  // Faster than the wire can answer means no waiting at all, which is another mistake.
  early_ = waiting_ > 0 && gap >= drive.shortest_answer && gap <= worst;
  ++waiting_;
  if (times_ < kTimes) return std::nullopt;
  if (!early_) return std::nullopt;
  return Finding{AdviceKind::kTimeoutBelowLatency,
                 &kTooEarly,
                 {static_cast<double>(times_), 1000 * in_s(gap), 1000 * in_s(worst)}};
}

void TimeoutWatch::hear_reply() {
  waiting_ = std::max(waiting_ - 1, 0);
  if (early_ && waiting_ > 0) times_ = std::min(times_ + 1, kTimes);
  early_ = false;
}

}  // namespace lk::emulator
