#include "emulator/monitor/advice/motion_watches.hpp"

#include <algorithm>
#include <cmath>

namespace lk::emulator {
namespace {

// clang-format off
constexpr BilingualText kLunged{"the output turned by {1}°, at up to {2} °/s, and the host had received no angle since {event}",
                        "{event}之后主机没有收到过角度，输出轴转了 {1}°，最高 {2} °/s"};
constexpr BilingualText kTurns{"no frame for {1} s, and the output turns on: by {2}° so far, at up to {3} °/s",
                       "{1} s 没有命令帧，输出轴仍在转：已转 {2}°，最高 {3} °/s"};
constexpr BilingualText kZero{"the first target since {event} is 0, {1}° from where the rotor stands",
                      "{event}之后第一个目标是 0，离转子当前位置 {1}°"};
constexpr BilingualText kWrapped{"the target {1}° is 2³² · 0.01° from the rotor, which stands at {2}°",
                         "目标 {1}° 与转子当前位置 {2}° 相差 2³² · 0.01°"};
constexpr BilingualText kShifted{"{1} queries in a row with the reply to an earlier query",
                         "连续 {1} 条命令帧都用了更早一条的回复"};
// clang-format on

}  // namespace

void UnaskedWatch::on_query(const DecodedQuery& query, const Suspect& suspect) {
  if (query.motion || query.is<protocol::Run>()) recent_[next_++ % kKept] = suspect;
}

/// Returns the host's frame that started the motion.
Suspect UnaskedWatch::starter(const UnaskedMotion& motion) const {
  for (std::size_t n = 1; n <= kKept; ++n) {
    const Suspect& one = recent_[(next_ + kKept - n) % kKept];
    if (one.number != 0 && one.at <= motion.from && one.frame == motion.frame) return one;
  }
  return {0, motion.from, motion.frame};
}

void UnaskedWatch::observe(const KnownDrive& drive, SimTime now, const Suspect& last,
                           AdviceLog& log) {
  const UnaskedMotion& motion = drive.unasked;
  runs_ = !motion.over;
  if (motion.number == 0) return;
  const auto finding_of = [&](AdviceKind kind, const BilingualText& what, auto... numbers) {
    Finding found = finding(kind, what, numbers...);
    found.event = &event_text(motion.event);
    return found;
  };
  if (motion.number != number_) {
    number_ = motion.number;
    reported_ = false;
    if (motion.to_zero) {
      log.note(drive.id,
               finding_of(AdviceKind::kFirstTargetZero, kZero, std::abs(motion.shaft_deg)),
               starter(motion));
    }
    if (motion.wrapped) {
      log.note(
          drive.id,
          finding_of(AdviceKind::kTargetWrapped, kWrapped, motion.target_deg, motion.shaft_deg),
          starter(motion));
    }
  }
  if (motion.deg <= Unasked::kFar_deg) return;
  if (motion.silent) {
    if (reported_ || motion.over || drive.input_window || now - motion.from < kLeft) return;
    reported_ = true;
    log.note(drive.id,
             finding_of(AdviceKind::kLeftTurning, kTurns, in_seconds(now - last.at), motion.deg,
                        motion.dps),
             last);
  } else if (motion.unread && (reported_ || !motion.turns || !motion.answered)) {
    if (first_lunge_ == 0) first_lunge_ = number_;
    Finding found = finding_of(AdviceKind::kLunge, kLunged, motion.deg, motion.dps);
    found.replaces_numbers = first_lunge_ == number_;
    if (!reported_ || found.replaces_numbers) {
      log.note(drive.id, found, starter(motion), reported_ ? 0 : 1);
    }
    reported_ = true;
  }
}

std::optional<Finding> AnswerWatch::on_query(SimTime at, const KnownDrive& drive) {
  if (replies_ == 0) {
    const bool waited = at - asked_ >= drive.shortest_answer;
    late_ = late_ || (waited && in_step_ >= kTimes);
    shifted_ = in_step_ = 0;
  } else if (replies_ == 1) {
    in_step_ = early_ ? 0 : std::min(in_step_ + 1, kTimes);
    late_ = late_ && in_step_ < kTimes;
    shifted_ = late_ && in_step_ < kPlain ? std::min(shifted_ + 1, kTimes) : 0;
  } else {  // the late reply, and the answer
    late_ = false;
    shifted_ = in_step_ = 0;
  }
  asked_ = at;
  replies_ = 0;
  early_ = false;
  if (shifted_ < kTimes) return std::nullopt;
  return finding(AdviceKind::kAnswersShifted, kShifted, kTimes);
}

void AnswerWatch::on_reply(SimTime at, const KnownDrive& drive) {
  ++replies_;
  early_ = early_ || at - asked_ < drive.shortest_answer;
}

}  // namespace lk::emulator
