#include "emulator/advice/path_watch.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace lk::emulator {
namespace {

// clang-format off
constexpr Words kTooFar{"a step of {1}° in a stream of targets needs {2} dps; the motor, or a limit, allows {3}",
                        "目标流中有一步为 {1}°，需要 {2} dps；电机或限值只允许 {3}"};
constexpr Words kBehind{"{1} increments in a row; the shaft is {2}° behind them, which is {3} s of them",
                        "连续 {1} 次增量；轴落后 {2}°，相当于 {3} s 的增量"};
// clang-format on

double seconds(SimTime time) { return std::chrono::duration<double>(time).count(); }

}  // namespace

bool JumpWatch::catches_up(double gap_s) {
  if (gap_s > 2 * mean_gap_s_) {
    behind_s_ = gap_s - mean_gap_s_;
    return false;
  }
  if (behind_s_ > 0 && kTooFast * gap_s < mean_gap_s_) {
    behind_s_ -= mean_gap_s_ - gap_s;
    return true;
  }
  behind_s_ = 0;
  return false;
}

std::optional<Finding> JumpWatch::hear(const Heard& heard, const KnownDrive& drive) {
  if (!heard.motion) return std::nullopt;
  if (!heard.motion->absolute()) {
    last_.reset();
    return std::nullopt;
  }
  const Target now{heard.at, heard.motion->value};
  const std::optional<Target> before = std::exchange(last_, now);
  if (!before || now.at - before->at > kPause) {
    moving_ = 0;
    mean_gap_s_ = 0;
    return std::nullopt;
  }
  const double gap_s = seconds(now.at - before->at);
  if (catches_up(gap_s)) return std::nullopt;
  if (now.at - before->at > kStream) {
    moving_ = 0;
    return std::nullopt;
  }
  // Equal times: the clock stood still or slipped, and the real gap is unknown.
  if (now.at == before->at) return std::nullopt;
  const double step_deg = std::abs(now.value_deg - before->value_deg);
  const bool streaming = moving_ == kMoving;
  // Frames come early and late, so the mean gap counts too.
  const double pace_s = std::max(mean_gap_s_, gap_s);
  mean_gap_s_ = mean_gap_s_ == 0 ? gap_s : mean_gap_s_ + (gap_s - mean_gap_s_) / kMoving;
  moving_ = step_deg > 0 ? std::min(moving_ + 1, kMoving) : 0;
  const double possible_dps = drive.fastest_dps(heard.motion->max_speed_dps);
  if (!streaming || step_deg < kLeast_deg || step_deg <= kTooFast * possible_dps * pace_s) {
    return std::nullopt;
  }
  return Finding{AdviceKind::kJump, &kTooFar, {step_deg, step_deg / pace_s, possible_dps}};
}

std::optional<Finding> WindUpWatch::hear(const Heard& heard, const KnownDrive& drive) {
  if (!heard.motion) {
    if (heard.is<protocol::Off>() || heard.is<protocol::Stop>() ||
        heard.is<protocol::ClearAngle>()) {
      run_.reset();  // the angle may have another zero
    }
    return std::nullopt;
  }
  const MotionCommand& motion = *heard.motion;
  if (!motion.increment() || motion.value == 0) {
    run_.reset();
    return std::nullopt;
  }
  const bool forward = motion.value > 0;
  if (!run_ || run_->forward != forward || heard.at - run_->last > kStream) {
    run_ = Run{.from = heard.at, .forward = forward};
  }
  run_->last = heard.at;
  ++run_->count;
  run_->commanded_deg += motion.value;
  if (run_->count <= kIncrements || !run_->shaft_from_deg) return std::nullopt;
  const double turned_deg = drive.angle_deg - *run_->shaft_from_deg;
  const double behind_deg = (forward ? 1 : -1) * (run_->commanded_deg - turned_deg);
  const double pace_dps = std::abs(run_->commanded_deg) / seconds(heard.at - run_->from);
  if (heard.at - run_->from < std::chrono::seconds(1) || behind_deg <= kBehind_s * pace_dps) {
    return std::nullopt;
  }
  return Finding{AdviceKind::kWindUp,
                 &kBehind,
                 {static_cast<double>(run_->count), behind_deg, behind_deg / pace_dps}};
}

void WindUpWatch::look(const KnownDrive& drive) {
  if (run_ && !run_->shaft_from_deg) run_->shaft_from_deg = drive.angle_deg;
}

}  // namespace lk::emulator
