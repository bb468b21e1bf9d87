#include "emulator/advice/trouble_watch.hpp"

#include <algorithm>

namespace lk::emulator {
namespace {

// clang-format off
constexpr Words kIsOff{"the drive is off: the command is answered and not executed",
                       "驱动器已关闭：命令得到回复，但不执行"};
constexpr Words kSwitchOn{"switch the drive on with 0x88, then move",
                          "先用 0x88 运行，然后才发运动命令"};
constexpr Words kHasError{"the drive has an error (errorState {1}): the command is answered and not executed",
                          "驱动器有错误（错误标志 {1}）：命令得到回复，但不执行"};
constexpr Words kClearFirst{"clear the error with 0x9B, switch the drive on with 0x88, then move",
                            "先用 0x9B 清除错误标志，再用 0x88 运行，然后才发运动命令"};
constexpr Words kIgnored{"the drive has had an error (errorState {1}) for {2} s, and the host has not asked for its state",
                         "驱动器出错（错误标志 {1}）已有 {2} s，主机一直没有查询状态"};
constexpr Words kLeft{"the drive has an error (errorState {1}), and the host, which had spoken to it until then, has been silent for 5 s without having asked for its state",
                      "驱动器出错（错误标志 {1}），此前一直与它通信的主机没有查询状态，已沉默 5 s"};
// clang-format on

}  // namespace

std::optional<Finding> TroubleWatch::hear(const Heard& heard, const Suspect& suspect,
                                          const KnownDrive& drive) {
  if (heard.at - last_.at > kPause) spoken_to_since_ = heard.at;
  const bool is_steady = heard.at - spoken_to_since_ >= kUnseen;
  last_ = suspect;
  if (heard.is<protocol::Off>() || heard.is<protocol::Run>()) off_ = heard.is<protocol::Off>();
  if (heard.motion) motions_[motion_count_++ % kKept] = {suspect, off_};
  // Another part of the host may not know this yet.
  if (heard.is<protocol::Off>()) quiet_until_ = std::max(quiet_until_, heard.at + kReaction);
  const bool asks = heard.is<protocol::ReadState1>() || heard.is<protocol::ClearErrors>();
  if (asks) asked_ = heard.at;
  if (!error_ || !drive.can_be_asked()) return std::nullopt;
  if (asks && !error_->asked) error_->asked = heard.at;
  const bool asks_now_and_then = asked_ && heard.at - *asked_ <= kUnseen;
  error_->was_spoken_to = error_->was_spoken_to || (is_steady && !asks_now_and_then);
  if (asks || heard.is<protocol::Off>() || heard.is<protocol::Run>()) error_->cared_for = true;
  const SimTime age = heard.at - error_->since;
  if (error_->cared_for || age < kUnseen) return std::nullopt;
  error_->queries = std::min(error_->queries + 1, kQueries);
  if (error_->queries < kQueries) return std::nullopt;
  return Finding{AdviceKind::kErrorIgnored,
                 &kIgnored,
                 {static_cast<double>(drive.errors), std::chrono::duration<double>(age).count()}};
}

std::optional<TroubleWatch::Seen> TroubleWatch::look(SimTime now, std::uint64_t arrived,
                                                     const KnownDrive& drive) {
  const std::uint64_t times = drive.refused_motion - std::exchange(refused_, drive.refused_motion);
  const std::uint64_t before = std::exchange(arrived_, arrived);
  if (!drive.alive) {  // power-off clears its errors
    error_.reset();
    return std::nullopt;
  }
  if (drive.errors != 0 && !error_) {
    error_ = Error{.since = now, .cared_for = asked_ && now - *asked_ <= kLookedLate};
  }
  const bool tell = times > 0 && motion_count_ > 0 && drive.can_be_asked() && to_be_told(now);
  if (drive.errors == 0 && error_) {
    error_.reset();
    quiet_until_ = now + kReaction;
  }
  if (!tell) return left_alone(now, drive);
  Finding finding{AdviceKind::kMotionRefused, &kIsOff};
  finding.todo = &kSwitchOn;
  if (drive.errors != 0) {
    finding.what = &kHasError;
    finding.todo = &kClearFirst;
    finding.numbers = {static_cast<double>(drive.errors)};
  }
  return Seen{finding, first_of(times, before, arrived), times};
}

std::optional<TroubleWatch::Seen> TroubleWatch::left_alone(SimTime now, const KnownDrive& drive) {
  const bool is_told = !error_ || error_->queries == kQueries;
  if (!waits() || is_told || now - last_.at < kSilence || !drive.can_be_asked()) {
    return std::nullopt;
  }
  error_->was_spoken_to = false;
  const auto errors = static_cast<double>(drive.errors);
  return Seen{{AdviceKind::kErrorIgnored, &kLeft, {errors}}, last_, 1};
}

bool TroubleWatch::to_be_told(SimTime now) const {
  if (!error_) return now >= quiet_until_;
  return (error_->asked && now - *error_->asked >= kReaction) || now - error_->since >= kUnseen;
}

const Suspect& TroubleWatch::first_of(std::uint64_t times, std::uint64_t before,
                                      std::uint64_t arrived) const {
  const auto back = [this](std::size_t n) -> const Motion& {
    return motions_[(motion_count_ - 1 - n) % kKept];
  };
  const std::size_t kept = std::min(motion_count_, kKept);
  std::size_t newest = 0;
  while (newest + 1 < kept && back(newest).suspect.number > arrived) ++newest;
  std::size_t oldest = newest;
  while (oldest + 1 < kept && back(oldest + 1).suspect.number > before) ++oldest;
  // The first command while off, if that explains all; otherwise an error began among them.
  std::uint64_t off = 0;
  std::size_t first_off = oldest;
  for (std::size_t n = newest; n <= oldest; ++n) {
    if (!back(n).off) continue;
    ++off;
    first_off = n;
  }
  if (off == times) return back(first_off).suspect;
  return back(std::min<std::size_t>(newest + times - 1, oldest)).suspect;
}

}  // namespace lk::emulator
