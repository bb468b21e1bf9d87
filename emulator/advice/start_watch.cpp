#include "emulator/advice/start_watch.hpp"

#include <cmath>

namespace lk::emulator {
namespace {

// clang-format off
constexpr Words kCleared{"0x9B for the {1}. time within {2} s: the first has cleared the errors, its reply shows those from before",
                         "{2} s 内第 {1} 次 0x9B：第一次就已清除，它的回复给出的是清除之前的标志"};
constexpr Words kFar{"the first target after a start, {1}°, is {2}° from where the rotor stands, {3}°",
                     "启动后第一个目标 {1}° 离转子当前位置 {3}° 有 {2}°"};
// clang-format on

}  // namespace

std::optional<Finding> ClearWatch::hear(const Heard& heard, const KnownDrive& drive) {
  if (heard.is<protocol::ReadState1>()) times_ = 0;
  if (!heard.is<protocol::ClearErrors>() || !drive.clear_reply_before) return std::nullopt;
  if (drive.errors != 0 || heard.at - first_ > kWithin) times_ = 0;
  if (times_ == 0) {
    first_ = heard.at;
    times_ = drive.errors != 0 ? 1 : 0;  // without errors the reply misleads nobody
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
  const double target_deg = heard.motion->value;
  const double way_deg = std::abs(target_deg - drive.angle_deg);
  // A target with the turn count of before is near the old position of the shaft.
  const bool by_old_count =
      angle_before_deg_ && std::abs(target_deg - *angle_before_deg_) < way_deg;
  if (way_deg < (by_old_count ? kFar_deg : kFar_deg * drive.gear_ratio)) return std::nullopt;
  return Finding{
      AdviceKind::kFirstTargetFar, &kFar, {heard.motion->value, way_deg, drive.angle_deg}};
}

void FirstTargetWatch::look(const KnownDrive& drive) {
  if (!drive.alive) return;
  if (start_ != 0 && drive.starts != start_) angle_before_deg_ = angle_deg_;
  start_ = drive.starts;
  angle_deg_ = drive.angle_deg;
}

}  // namespace lk::emulator
