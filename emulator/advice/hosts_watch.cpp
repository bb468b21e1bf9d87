#include "emulator/advice/hosts_watch.hpp"

#include <algorithm>
#include <cmath>

namespace lk::emulator {
namespace {

using protocol::Opcode;

// clang-format off
constexpr Words kBetween{"{1} stands between {2} and {3}, within 100 ms, and not for the first time: two programs command this drive",
                         "{2} 与 {3} 之间夹着 {1}，间隔不到 100 ms，而且不止一次：有两个程序在指挥这台驱动器"};
constexpr Words kKinds{"commands of two kinds take turns within 100 ms, again and again: two programs command this drive",
                       "两种命令在 100 ms 之内反复交替：有两个程序在指挥这台驱动器"};
// clang-format on

/// Smaller differences may be a host's own: noise, dither (assumed). In A, per mille, dps, degrees.
double noticeable(Opcode opcode) {
  return opcode == Opcode::kTorque ? 0.5 : opcode == Opcode::kOpenLoop ? 50 : 5;
}

/// A host may shake a motor with a current that changes its sign with every command.
bool shakes(const MotionCommand& a, const MotionCommand& b) {
  const bool force = a.opcode == Opcode::kTorque || a.opcode == Opcode::kOpenLoop;
  return force && std::abs(a.value + b.value) <= 0.2 * std::abs(a.value);
}

bool increments(const MotionCommand& motion) {
  return motion.increment();  // they say nothing of where the host wants to be
}

}  // namespace

bool HostsWatch::there_and_back(const Said& now) const {
  const auto& [there, before] = before_;
  if (now.at - before.at > kThereAndBack || now.motion.opcode != before.motion.opcode) return false;
  if (there.motion.opcode != now.motion.opcode) return true;
  if (increments(now.motion) || shakes(now.motion, there.motion)) return false;
  const double way = std::abs(there.motion.value - before.motion.value);
  const double rest = std::abs(now.motion.value - before.motion.value);
  return way >= noticeable(now.motion.opcode) && rest <= way / 10;
}

std::optional<Finding> HostsWatch::hear(const Heard& heard) {
  if (!heard.motion) return std::nullopt;
  const Said now{heard.at, *heard.motion};
  const bool found = known_ == 2 && there_and_back(now);
  const Said there = before_[0];
  const Said before = before_[1];
  before_ = {now, there};
  known_ = std::min(known_ + 1, 2);
  if (!found) return std::nullopt;
  times_ = heard.at - last_time_ <= kAgain ? std::min(times_ + 1, kTimes) : 1;
  last_time_ = heard.at;
  if (times_ < kTimes) return std::nullopt;
  if (there.motion.opcode != now.motion.opcode) {
    return Finding{AdviceKind::kSeveralHosts, &kKinds};
  }
  return Finding{AdviceKind::kSeveralHosts,
                 &kBetween,
                 {there.motion.value, before.motion.value, now.motion.value}};
}

}  // namespace lk::emulator
