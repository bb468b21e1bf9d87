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

constexpr double kNoticeable = 5;  // dps or degrees; less may be noise (assumed)

/// One controller alone goes there and back with these: bang-bang, dither, noise of its sensors.
bool is_force(Opcode opcode) {
  return opcode == protocol::Torque::kOpcode || opcode == protocol::OpenLoop::kOpcode;
}

}  // namespace

/// As one host's next command is to the one before, next to what lies between them.
bool HostsWatch::alike(std::size_t a, std::size_t b) const {
  const MotionCommand& one = back(a).motion;
  const MotionCommand& other = back(b).motion;
  if (one.opcode != other.opcode) return false;
  if (back(0).motion.opcode != back(1).motion.opcode) return true;  // that is plain enough
  const double way = std::abs(back(1).motion.value - back(0).motion.value);
  return std::abs(one.value - other.value) <= way / 10;
}

/// The last two are no two commands of one host.
bool HostsWatch::apart() const {
  const MotionCommand& now = back(0).motion;
  const MotionCommand& there = back(1).motion;
  if (now.opcode != there.opcode) return true;
  // Increments say nothing of where a host wants to be.
  return !now.increment() && !is_force(now.opcode) &&
         std::abs(there.value - now.value) >= kNoticeable;
}

bool HostsWatch::there_and_back() const {
  if (count_ < kKept || back(0).at - back(2).at > kThereAndBack || !apart()) return false;
  const auto of_either = [this](std::size_t n) { return alike(n, 0) || alike(n, 1); };
  return alike(2, 0) && of_either(3) && of_either(4) && of_either(5);
}

std::optional<Finding> HostsWatch::hear(const Heard& heard) {
  if (!heard.motion) return std::nullopt;
  said_[count_++ % kKept] = {heard.at, *heard.motion};
  if (!there_and_back()) return std::nullopt;
  times_ = heard.at - last_time_ <= kAgain ? std::min(times_ + 1, kTimes) : 1;
  last_time_ = heard.at;
  if (times_ < kTimes) return std::nullopt;
  if (back(0).motion.opcode != back(1).motion.opcode) {
    return Finding{AdviceKind::kSeveralHosts, &kKinds};
  }
  return Finding{AdviceKind::kSeveralHosts,
                 &kBetween,
                 {back(1).motion.value, back(2).motion.value, back(0).motion.value}};
}

}  // namespace lk::emulator
