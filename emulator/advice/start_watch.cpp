#include "emulator/advice/start_watch.hpp"

#include <cmath>

namespace lk::emulator {
namespace {

constexpr auto kReadGains = static_cast<std::uint8_t>(protocol::ReadPid::kOpcode);
constexpr auto kReadParameter = static_cast<std::uint8_t>(protocol::ReadParameter::kOpcode);

// clang-format off
constexpr Words kCleared{"0x9B for the {1}. time within {2} s: the first has cleared the errors, its reply shows those from before",
                         "{2} s 内第 {1} 次 0x9B：第一次就已清除，它的回复给出的是清除之前的标志"};
constexpr Words kFar{"the first target after a start, {1}°, is {2}° from where the rotor stands, {3}°",
                     "启动后第一个目标 {1}° 离转子当前位置 {3}° 有 {2}°"};
constexpr Words kOnce{"{command} was asked once, {1} s ago, and had no answer: one lost frame would look the same",
                      "{command} 只在 {1} s 前问过一次，没有回复：丢一帧也是这样"};
// clang-format on

}  // namespace

std::optional<Finding> ClearWatch::hear(const Heard& heard, const KnownDrive& drive) {
  if (heard.is<protocol::ReadState1>()) times_ = 0;
  if (!heard.is<protocol::ClearErrors>() || !drive.clear_reply_before) return std::nullopt;
  if (drive.errors != 0 || heard.at - first_ > kWithin) times_ = 0;
  if (times_ == 0) {
    first_ = heard.at;
    times_ = drive.errors != 0 ? 1 : 0;  // where there is nothing to clear nobody is misled
    return std::nullopt;
  }
  if (++times_ < kTimes) return std::nullopt;
  return Finding{AdviceKind::kTrustsClearReply,
                 &kCleared,
                 {static_cast<double>(times_), in_s(heard.at - first_)}};
}

std::optional<Finding> FirstTargetWatch::hear(const Heard& heard, const KnownDrive& drive) {
  if (drive.starts == known_start_) return std::nullopt;
  const bool asks = heard.is<protocol::ReadMultiTurnAngle>();
  const bool sets = heard.is<protocol::ClearAngle>();
  const bool aims = heard.motion && heard.motion->absolute();
  if (!asks && !sets && !aims) return std::nullopt;
  known_start_ = drive.starts;
  if (!aims) return std::nullopt;
  const double way_deg = std::abs(heard.motion->value - drive.angle_deg);
  if (way_deg < kFar_deg) return std::nullopt;
  return Finding{
      AdviceKind::kFirstTargetFar, &kFar, {heard.motion->value, way_deg, drive.angle_deg}};
}

std::optional<Finding> GuessWatch::hear(SimTime at, std::uint8_t command) {
  for (auto& [byte, probe] :
       {std::pair(kReadGains, &gains_), std::pair(kReadParameter, &parameter_)}) {
    if (command == byte) {
      probe->at = at;
      ++probe->times;
      continue;
    }
    if (probe->times != 1 || probe->answered) continue;
    ++probe->others;
    if (probe->others < kOthers || at - probe->at < kNotAgain) continue;
    probe->times = 0;  // told
    probe->others = 0;
    Finding finding{AdviceKind::kDialectGuessed, &kOnce, {in_s(at - probe->at)}};
    finding.command = byte;
    return finding;
  }
  return std::nullopt;
}

void GuessWatch::hear_reply(std::uint8_t command) {
  if (command == kReadGains) gains_.answered = true;
  if (command == kReadParameter) parameter_.answered = true;
}

}  // namespace lk::emulator
