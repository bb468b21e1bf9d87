#include "tools/guess/motion_watch.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <utility>

#include "protocol/codec.hpp"

namespace lk::emulator {
namespace {

using namespace std::chrono_literals;

// Limits, all assumed: far above noise, and small enough not to miss a wrap-around of the field.
constexpr double kLeastTurn_cdeg = 1000;
constexpr double kMaxTurn_cdeg = 12'000;
constexpr SimTime kTogether = 20ms;  // longest time between the replies with field and angle
constexpr int kAtRest_dps = 3;
constexpr std::size_t kFewestTurns = 3;
constexpr std::size_t kMaxTurns = 63;
constexpr double kTolerance = 0.03;

// Counts per turn of LK-TECH encoders with 12, 14, 15 and 16 bits. The field shows 16 bits of an
// 18-bit encoder.
constexpr double kRotorTurns[] = {4096, 16'384, 32'768, 65'536};
// Gear ratios of the geared motors, whose encoders have 18 bits (docs/start/which-drive.md).
constexpr double kRatios[] = {6, 8, 9, 10, 36};

bool is_near(double value, double expected) { return std::abs(value / expected - 1) <= kTolerance; }

}  // namespace

void EncoderWatch::field(std::uint16_t counts, std::optional<int> speed_dps,
                         std::optional<SimTime> at) {
  largest_ = std::max(largest_.value_or(0), counts);
  last_ = {counts, speed_dps, at};
}

std::optional<SeenTurn> EncoderWatch::angle(std::int64_t angle_cdeg, std::optional<SimTime> at) {
  if (!last_ || !last_->speed_dps) return std::nullopt;
  double since_s = 0;
  if (at && last_->at) {
    if (*at < *last_->at || *at - *last_->at > kTogether) return std::nullopt;
    since_s = in_seconds(*at - *last_->at);
  } else if (std::abs(*last_->speed_dps) > kAtRest_dps) {
    return std::nullopt;
  }
  const Place now{static_cast<double>(angle_cdeg) - 100.0 * *last_->speed_dps * since_s,
                  last_->counts};
  if (!from_) from_ = now;
  const double turned_cdeg = now.angle_cdeg - from_->angle_cdeg;
  if (std::abs(turned_cdeg) < kLeastTurn_cdeg) return std::nullopt;
  const double per_turn = (now.counts - from_->counts) / turned_cdeg * 36'000;
  from_ = now;
  if (std::abs(turned_cdeg) > kMaxTurn_cdeg) return std::nullopt;
  if (per_turn_.size() < kMaxTurns) per_turn_.push_back(per_turn);
  for (const double counts : kRotorTurns) {
    if (is_near(per_turn, counts)) return SeenTurn{EncoderSpan::kRotorTurn, counts};
  }
  for (const double ratio : kRatios) {
    if (is_near(per_turn * ratio, kRotorTurns[3]))
      return SeenTurn{EncoderSpan::kOutputTurn, kRotorTurns[3]};
  }
  return std::nullopt;
}

/// Uses the median, because a wrap-around between two replies makes a sample wrong by a turn.
std::optional<double> EncoderWatch::counts_per_turn() const {
  if (per_turn_.size() < kFewestTurns) return std::nullopt;
  std::vector<double> sorted = per_turn_;
  std::ranges::sort(sorted);
  const double median = sorted[sorted.size() / 2];
  const auto agree = std::ranges::count_if(
      sorted, [median](double one) { return median != 0 && is_near(one, median); });
  return 2 * static_cast<std::size_t>(agree) > sorted.size() ? std::optional(median) : std::nullopt;
}

namespace {

using protocol::get_le;
using protocol::Opcode;
using namespace std::chrono_literals;

// Limits, all assumed: they separate turning, rest and noise by a large margin.
constexpr double kTurningFrom_dps = 100;
constexpr double kTurns = 0.5;  // share of the commanded speed from which the shaft turns
constexpr double kRests_dps = 3;
constexpr SimTime kSlowestRise = 10s;
constexpr SimTime kStaysFor = 300ms;
constexpr SimTime kLimitActsAfter = 20ms;
constexpr std::uint64_t kLimitReplies = 3;
constexpr double kBeyond = 1.2;
constexpr double kBeyondBy_lsb = 30;
constexpr SimTime kAngleWithin = 1s;
constexpr std::int64_t kSameAngle_cdeg = 500;
constexpr std::int64_t kOtherAngle_cdeg = 5000;

bool is_motion(const protocol::Frame& frame) {
  return protocol::find_multi_drive(frame.id) != nullptr ||
         (frame.data[0] >= static_cast<std::uint8_t>(protocol::OpenLoop::kOpcode) &&
          frame.data[0] <= static_cast<std::uint8_t>(protocol::Position6::kOpcode));
}

}  // namespace

void MotionWatch::query(const Sighting& query) {
  if (!query.at) return;
  const auto& data = query.frame.data;
  const auto command = static_cast<Opcode>(data[0]);
  const bool several = protocol::find_multi_drive(query.frame.id) != nullptr;
  if (!several && command == protocol::Speed::kOpcode) {
    const double speed_dps = get_le<std::int32_t>(data, 4) / 100.0;
    const bool enough = std::abs(speed_dps) >= kTurningFrom_dps;
    const int limit_lsb = get_le<std::int16_t>(data, 2);
    if (limit_lsb != limit_lsb_) {
      limit_lsb_ = limit_lsb;
      limited_since_ = *query.at;
      held_ = 0;
    }
    // A repeated command changes nothing while the shaft turns. If the shaft did not turn after
    // 0x88, a speed command tests that the drive executes commands.
    if (run_ == Run::kStayed && enough) {
      speed_dps_ = speed_dps;
    } else if (!enough) {
      run_ = Run::kNone;
    } else if (speed_dps != speed_dps_ || (run_ != Run::kAsked && run_ != Run::kTurning)) {
      run_ = Run::kAsked;
      speed_dps_ = speed_dps;
      since_ = *query.at;
    }
    return;
  }
  if (several || is_motion(query.frame)) {
    run_ = Run::kNone;
    limit_lsb_ = 0;
    return;
  }
  if (command == protocol::Stop::kOpcode) {
    if (run_ != Run::kStopping) run_ = run_ == Run::kTurning ? Run::kStopping : Run::kNone;
    limit_lsb_ = 0;
  } else if (command == protocol::Run::kOpcode) {
    run_ = run_ == Run::kResting ? Run::kRunSent : Run::kNone;
    run_at_ = *query.at;
  } else if (command == protocol::ClearAngle::kOpcode) {
    cleared_to_cdeg_ = {*query.at, get_le<std::int32_t>(data, 4)};
  } else if (command == protocol::Off::kOpcode || command == protocol::ClearErrors::kOpcode) {
    run_ = Run::kNone;
    limit_lsb_ = 0;
    if (command == protocol::ClearErrors::kOpcode) return;
    angle_cdeg_.reset();  // the turn count is lost
    cleared_to_cdeg_.reset();
  }
}

void MotionWatch::reply(const Sighting& reply, Evidence& evidence) {
  if (!reply.at) return;
  const std::uint8_t command = reply.frame.data[0];
  if (command == static_cast<std::uint8_t>(protocol::ReadMultiTurnAngle::kOpcode))
    angle(reply, evidence);
  const bool moves = is_motion(reply.frame) && reply.frame.data[1] > 1;
  if (moves || command == static_cast<std::uint8_t>(protocol::ReadState2::kOpcode))
    state_2(reply, evidence);
}

void MotionWatch::state_2(const Sighting& reply, Evidence& evidence) {
  const double speed_dps = get_le<std::int16_t>(reply.frame.data, 4);
  const double iq_lsb = std::abs(static_cast<double>(get_le<std::int16_t>(reply.frame.data, 2)));
  // A load, not the drive, may turn the shaft backwards or beyond the commanded speed.
  const bool driven =
      speed_dps * speed_dps_ < 0 || std::abs(speed_dps) > kBeyond * std::abs(speed_dps_);
  if (limit_lsb_ > 0 && !driven && *reply.at - limited_since_ >= kLimitActsAfter &&
      ++held_ >= kLimitReplies && iq_lsb > kBeyond * limit_lsb_ + kBeyondBy_lsb &&
      ++beyond_ >= kLimitReplies) {
    evidence.see(Trait::kSpeedLimit, only(kSwitchedOff), Weight::kLikely, reply);
  }
  const bool turns =
      speed_dps * speed_dps_ > 0 && std::abs(speed_dps) >= kTurns * std::abs(speed_dps_);
  const bool rests = std::abs(speed_dps) <= kRests_dps;
  switch (run_) {
    case Run::kAsked:
      if (turns) {
        run_ = Run::kTurning;
        rise_ = *reply.at - since_;
        if (rise_ < SimTime{0} || rise_ > kSlowestRise) run_ = Run::kNone;
      }
      break;
    case Run::kStopping:
      if (rests) run_ = Run::kResting;
      break;
    case Run::kRunSent:
      if (turns) {
        evidence.see(Trait::kRunResumes, only(kSwitchedOn), Weight::kLikely, reply);
        run_ = Run::kNone;
      } else if (rests && *reply.at - run_at_ >= kStaysFor + 2 * rise_) {
        run_ = Run::kStayed;
        stayed_ = reply;
      }
      break;
    case Run::kStayed:
      // The drive executes the next command, so it was not switched off by an error.
      if (turns) {
        evidence.see(Trait::kRunResumes, only(kSwitchedOff), Weight::kLikely, stayed_);
        run_ = Run::kTurning;
      }
      break;
    case Run::kNone:
    case Run::kTurning:
    case Run::kResting:
      break;
  }
}

void MotionWatch::angle(const Sighting& reply, Evidence& evidence) {
  const std::int64_t now_cdeg = protocol::get_le56(reply.frame.data);
  const auto before = std::exchange(angle_cdeg_, {{*reply.at, now_cdeg}});
  const auto sent = std::exchange(cleared_to_cdeg_, {});
  if (!before || !sent || before->first > sent->first) return;
  if (*reply.at - before->first > kAngleWithin) return;
  ValueSet allowed = 0;
  const std::int64_t expected_cdeg[] = {before->second, 0, sent->second};
  for (std::size_t value = 0; value < std::size(expected_cdeg); ++value) {
    const std::int64_t off_cdeg = now_cdeg - expected_cdeg[value];
    if (std::abs(off_cdeg) <= kSameAngle_cdeg) {
      allowed |= only(value);
    } else if (std::abs(off_cdeg) < kOtherAngle_cdeg) {
      return;
    }
  }
  evidence.see(Trait::kClearAngle, allowed, Weight::kLikely, reply);
}

}  // namespace lk::emulator
