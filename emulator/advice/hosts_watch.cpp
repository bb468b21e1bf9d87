#include "emulator/advice/hosts_watch.hpp"

#include <algorithm>
#include <cmath>

namespace lk::emulator {
namespace {

using protocol::Opcode;

// clang-format off
constexpr Words kBetween{"{1} comes between commands of {2}, which keep their own rhythm, and not for the first time: two programs command this drive",
                         "{2} 的命令保持自己的节奏，其间却夹着 {1}，而且不止一次：有两个程序在指挥这台驱动器"};
constexpr Words kKinds{"commands of two kinds, each in its own rhythm, again and again: two programs command this drive",
                       "两种命令各按自己的节奏反复出现：有两个程序在指挥这台驱动器"};
// clang-format on

constexpr double kNoticeable = 5;  // dps or degrees; a smaller difference may be noise (assumed)

/// One controller alone alternates these values: bang-bang, dither, sensor noise.
bool is_force(Opcode opcode) {
  return opcode == protocol::Torque::kOpcode || opcode == protocol::OpenLoop::kOpcode;
}

/// Spread of the gaps between frames.
class Spread {
 public:
  void add(SimTime gap) {
    least_ = std::min(least_, gap);
    most_ = std::max(most_, gap);
  }
  SimTime value() const { return most_ - least_; }
  SimTime most() const { return most_; }

 private:
  SimTime least_ = SimTime::max();
  SimTime most_{0};
};

}  // namespace

/// Returns true if both may be consecutive commands of one host, compared with the last step.
bool HostsWatch::alike(const MotionCommand& one, const MotionCommand& other) const {
  if (one.opcode != other.opcode) return false;
  if (back(0).motion.opcode != back(1).motion.opcode) return true;  // different kinds suffice
  const double way = std::abs(back(1).motion.value - back(0).motion.value);
  return std::abs(one.value - other.value) <= way / 10;
}

/// Returns true if the last two frames are unlikely to come from one host.
bool HostsWatch::apart() const {
  const MotionCommand& now = back(0).motion;
  const MotionCommand& there = back(1).motion;
  if (now.opcode != there.opcode) return true;
  // Increments do not show which position a host wants.
  return !now.increment() && !is_force(now.opcode) &&
         std::abs(there.value - now.value) >= kNoticeable;
}

/// Evaluates the last frame against the rhythm of earlier frames that are alike.
HostsWatch::Sign HostsWatch::sign() const {
  if (!apart()) return Sign::kNone;
  Spread own;  // of the frames like the last one
  Spread all;
  std::size_t last = 0;
  std::size_t found = 1;
  const std::size_t kept = std::min(count_, kKept);
  for (std::size_t n = 1; n < kept && found < kRhythm; ++n) {
    all.add(back(n - 1).at - back(n).at);
    if (!alike(back(n).motion, back(last).motion)) continue;
    own.add(back(last).at - back(n).at);
    if (own.most() > kThereAndBack) return Sign::kNone;
    last = n;
    ++found;
  }
  if (found < kRhythm) return Sign::kNone;
  const SimTime mean = (back(0).at - back(last).at) / static_cast<std::int64_t>(last);
  if (all.value() * 5 < mean) return Sign::kNone;  // as even as one host, or two in turns
  if (own.value() * 4 > all.value()) return Sign::kOneHost;
  // Delayed frames leave together, and may be of any kind.
  std::size_t before = 2;
  while (!alike(back(before).motion, back(0).motion)) ++before;
  const SimTime gap = back(0).at - back(before).at;
  const SimTime nearest = std::min(back(0).at - back(1).at, back(before - 1).at - back(before).at);
  return nearest * 7 < gap ? Sign::kNone : Sign::kSeveral;
}

std::optional<Finding> HostsWatch::hear(const Heard& heard) {
  if (!heard.motion) return std::nullopt;
  said_[count_++ % kKept] = {heard.at, *heard.motion};
  if (count_ < 2) return std::nullopt;
  const Sign sign = this->sign();
  if (sign == Sign::kOneHost) times_ = std::max(times_ - 1, 0);
  if (sign != Sign::kSeveral) return std::nullopt;
  times_ = heard.at - last_time_ <= kAgain ? std::min(times_ + 1, kTimes) : 1;
  last_time_ = heard.at;
  if (times_ < kTimes) return std::nullopt;
  if (back(0).motion.opcode != back(1).motion.opcode) {
    return Finding{AdviceKind::kSeveralHosts, &kKinds};
  }
  return Finding{
      AdviceKind::kSeveralHosts, &kBetween, {back(1).motion.value, back(0).motion.value}};
}

}  // namespace lk::emulator
