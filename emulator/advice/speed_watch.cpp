#include "emulator/advice/speed_watch.hpp"

#include <algorithm>
#include <cmath>

namespace lk::emulator {
namespace {

// clang-format off
constexpr Words kArrived{"the shaft passed {1}° when the host left the speed of {1} dps, {2} times in a row: it means angles",
                         "连续 {2} 次都在轴转过 {1}° 时换掉了 {1} dps 的速度：主机想说的是角度"};
constexpr Words kPath{"speeds that start at the angle of the shaft and continue in small steps, to {1} dps by now: they are angles",
                      "这串速度从轴的角度开始、以小步变化，现在是 {1} dps：它们其实是角度"};
// clang-format on

}  // namespace

std::optional<Finding> SpeedWatch::hear(const Heard& heard, const KnownDrive& drive) {
  if (heard.is<protocol::ReadMultiTurnAngle>() || heard.is<protocol::ReadSingleTurnAngle>()) {
    angle_read_ = heard.at;
  }
  const bool ends = heard.is<protocol::Off>() || heard.is<protocol::Stop>();
  if (!heard.motion && !ends) return std::nullopt;
  if (ends || heard.motion->opcode != protocol::Speed::kOpcode) {
    value_.reset();
    arrivals_ = 0;
    steps_.reset();
    return std::nullopt;
  }
  const double value = heard.motion->value;
  if (!value_) {
    if (starts_at_shaft(value, heard.at, drive)) steps_ = 0;
    value_ = value;
    since_ = heard.at;
    return std::nullopt;
  }
  auto found = follow_path(value);
  if (value != *value_) {
    if (auto left = leave_target(value, heard.at, drive)) found = left;
    value_ = value;
    since_ = heard.at;
  }
  return found;
}

bool SpeedWatch::starts_at_shaft(double value, SimTime at, const KnownDrive& drive) const {
  return std::abs(value) >= kLeast_dps && angle_read_ && at - *angle_read_ <= kJustRead &&
         std::abs(value - drive.angle_deg) <= kStart_deg;
}

/// Each step must change the value: a constant value is a speed, or the end of a path.
std::optional<Finding> SpeedWatch::follow_path(double value) {
  if (!steps_) return std::nullopt;
  const double step = std::abs(value - *value_);
  if (step > kStep_dps || (step == 0 && *steps_ < kSteps)) {
    steps_.reset();
    return std::nullopt;
  }
  steps_ = std::min(*steps_ + 1, kSteps);
  if (*steps_ < kSteps) return std::nullopt;
  return Finding{AdviceKind::kSpeedAsPosition, &kPath, {value}};
}

std::optional<Finding> SpeedWatch::leave_target(double value, SimTime at, const KnownDrive& drive) {
  const double near_deg = kNear_deg + kReaction_s * std::abs(*value_);
  const bool arrived = at - since_ >= kHeld && std::abs(*value_) >= kLeast_dps &&
                       std::abs(value) >= kLeast_dps &&
                       std::abs(drive.angle_deg - *value_) <= near_deg;
  // A sweep between two limits meets one number repeatedly by chance.
  const bool anew = std::abs(std::abs(*value_) - arrived_dps_) >= kLeast_dps;
  arrivals_ = !arrived ? 0 : anew || arrivals_ == 0 ? arrivals_ + 1 : arrivals_;
  if (arrived) arrived_dps_ = std::abs(*value_);
  if (arrivals_ < kArrivals) return std::nullopt;
  return Finding{
      AdviceKind::kSpeedAsPosition, &kArrived, {*value_, static_cast<double>(arrivals_)}};
}

}  // namespace lk::emulator
