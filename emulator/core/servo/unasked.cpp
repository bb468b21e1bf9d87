#include "emulator/core/servo/unasked.hpp"

#include <algorithm>
#include <cmath>

#include "emulator/core/units.hpp"

namespace lk::emulator {
namespace {

constexpr double kWrap_cdeg = 4294967296;  // 2^32

const model::Setpoint& setpoint_of(const Lane& lane) {
  return lane.bank.inputs(lane.index).setpoint;
}

/// Returns the value of a set point that turns the shaft without end; 0 for others.
double endless_value(const model::Setpoint& setpoint) {
  if (const auto* speed = std::get_if<model::Speed>(&setpoint)) return speed->omega;
  if (const auto* torque = std::get_if<model::Torque>(&setpoint)) return torque->i_q;
  if (const auto* power = std::get_if<model::OpenLoop>(&setpoint)) return power->power;
  return 0;
}

const double* target_of(const model::Setpoint& setpoint) {
  const auto* position = std::get_if<model::Position>(&setpoint);
  return position != nullptr ? &position->theta : nullptr;
}

/// Returns true if both set points lead to the same place or speed. Their limits may differ.
bool same(const model::Setpoint& one, const model::Setpoint& other) {
  if (one.index() != other.index()) return false;
  const double* target = target_of(one);
  const double* other_target = target_of(other);
  if (target != nullptr && other_target != nullptr) return *target == *other_target;
  return endless_value(one) == endless_value(other);
}

bool has_target(const protocol::Command& command) {
  return std::visit(
      [](const auto& one) {
        return requires { one.target_cdeg; };
      },
      command);
}

bool has_angle(const Reply& reply) {
  return std::holds_alternative<protocol::State2>(reply) ||
         std::holds_alternative<protocol::Encoder>(reply) ||
         std::holds_alternative<protocol::MultiTurnAngle>(reply) ||
         std::holds_alternative<protocol::SingleTurnAngle>(reply);
}

// Indexed by AngleEvent.
constexpr std::array<BilingualText, 7> kEvents = {{{"the start", "启动"},
                                                   {"the restart", "重新启动"},
                                                   {"0x80", "0x80"},
                                                   {"0x81", "0x81"},
                                                   {"the error", "出错"},
                                                   {"the fault", "注入故障"},
                                                   {"the host's silence", "主机静默"}}};

}  // namespace

const BilingualText& event_text(AngleEvent event) {
  return kEvents[static_cast<std::size_t>(event)];
}

void Unasked::on_event(AngleEvent event) {
  event_ = event;
  known_ = false;
  first_target_ = true;
  sampled_.reset();
  if (event != AngleEvent::kFault && event != AngleEvent::kSilence) motion_.over = true;
  if (event == AngleEvent::kStart || event == AngleEvent::kRestart) tripped_ = false;
}

std::optional<SimTime> Unasked::silence_limit() const {
  if (gap_count_ < kGaps) return std::nullopt;
  return kPeriods * *std::ranges::max_element(gaps_);
}

void Unasked::on_query(SimTime at, bool replayed) {
  if (last_query_) {
    const SimTime gap = at - *last_query_;
    const bool longer = gap > kPeriods * gaps_[(gap_count_ - 1) % kGaps];  // than most limits
    if (longer && gap > silence_limit().value_or(gap)) on_event(AngleEvent::kSilence);
    if (!replayed) gaps_[gap_count_++ % kGaps] = gap;
  }
  last_query_ = at;
}

void Unasked::begin(const UnaskedMotion& motion, const Lane& lane) {
  const std::uint64_t number = motion_.number + 1;
  motion_ = motion;
  motion_.number = number;
  motion_.over = false;
  motion_.event = event_;
  from_rad_ = lane.bank.truth(lane.index).theta_out;
  work_J_ = 0;
  sampled_at_ = moved_at_ = motion.from;
}

/// Returns true if the new set point continues the unasked motion. A host that knows the angle
/// stops the shaft, or gives a target near it.
bool Unasked::continues(const model::Setpoint& before, const model::Setpoint& now,
                        const Lane& lane) const {
  if (motion_.silent) return false;
  if (!known_ && motion_.unread) return true;
  const double* const target = target_of(now);
  const double* const old = target_of(before);
  if (target == nullptr || old == nullptr) return false;
  const model::Truth truth = lane.bank.truth(lane.index);
  const double gear = lane.bank.inputs(lane.index).params.mechanics.gear_ratio;
  const double way = std::abs(*target - truth.theta_m);
  return way > kFar_deg * kRadPerDeg * gear && std::abs(*target - *old) < way;
}

/// Returns true if the new set point goes on with a motion from before the event. An injected fault
/// does not end the motion that it disturbs.
bool Unasked::is_old(const model::Setpoint& before, const model::Setpoint& now, double gear) const {
  if (event_ != AngleEvent::kFault) return false;
  const double* const target = target_of(now);
  const double* const old = target_of(before);
  if (target == nullptr || old == nullptr) return endless_value(before) * endless_value(now) > 0;
  return std::abs(*target - *old) <= kFar_deg * kRadPerDeg * gear;
}

void Unasked::on_executed(SimTime at, const Servo& servo, const Query& query,
                          const protocol::Frame& frame, const model::Setpoint& before,
                          const Lane& lane) {
  if (servo.tripped && !tripped_) on_event(AngleEvent::kError);
  tripped_ = servo.tripped;
  if (std::holds_alternative<protocol::Off>(query.command)) return on_event(AngleEvent::kOff);
  if (std::holds_alternative<protocol::Stop>(query.command)) return on_event(AngleEvent::kStop);
  const bool is_first = first_target_ && has_target(query.command) && servo.motion.position;
  if (is_first) first_target_ = false;
  const model::Setpoint& now = setpoint_of(lane);
  if (same(before, now)) return;
  const double* const target = target_of(now);
  if (target == nullptr && endless_value(now) == 0) {
    motion_.over = true;
    return;
  }
  if (!motion_.over && continues(before, now, lane)) return;
  motion_.over = true;
  const double gear = servo.config.profile.drive.mechanics.gear_ratio;
  UnaskedMotion motion;
  motion.unread = !known_ && !is_old(before, now, gear);
  motion.turns = target == nullptr;
  if (target != nullptr && servo.motion.multi_turn_cdeg) {
    const auto target_cdeg = static_cast<double>(*servo.motion.multi_turn_cdeg);
    motion.target_deg = target_cdeg / 100;
    motion.shaft_deg = servo.multi_turn_deg(lane.telemetry());
    const double way_cdeg = std::abs(target_cdeg - 100 * motion.shaft_deg);
    motion.to_zero = is_first && target_cdeg == 0 && way_cdeg > 100 * kFar_deg * gear;
    motion.wrapped = std::abs(way_cdeg - kWrap_cdeg) <= protocol::kTurn_cdeg * gear;
  }
  if (!motion.unread && !motion.to_zero && !motion.wrapped) return;
  motion.from = at;
  motion.frame = frame;
  begin(motion, lane);
}

void Unasked::on_answer(const Reply& reply, std::uint8_t byte) {
  if (!known_ && has_angle(reply)) sampled_.set(byte);
}

void Unasked::on_received(const protocol::Frame& frame) {
  if (known_) return;
  // Bytes from an RS-485 adapter may be a part of a packet.
  known_ = frame.kind == protocol::FrameKind::kBytes ? sampled_.any() : sampled_[frame.data[0]];
  if (!known_) return;
  motion_.answered = true;
  if (motion_.silent) motion_.over = true;
}

std::optional<SimTime> Unasked::take_next_step(SimTime now, const Lane& lane) {
  if (scheduled_) return std::nullopt;
  std::optional<SimTime> next;
  if (!motion_.over) {
    // A host that knows of a turning drive can let it turn for hours.
    const SimTime period = motion_.turns && motion_.answered ? kLongPeriod : kPeriod;
    next = (now / period + 1) * period;  // drives of a bus are sampled together
  } else if (last_query_ && endless_value(setpoint_of(lane)) != 0) {
    if (const auto limit = silence_limit()) next = std::max(*last_query_ + *limit, now + kPeriod);
  }
  scheduled_ = next.has_value();
  return next;
}

void Unasked::step(SimTime now, const Servo& servo, const Lane& lane) {
  scheduled_ = false;
  const model::Setpoint& setpoint = setpoint_of(lane);
  if (motion_.over) {
    const auto limit = silence_limit();
    if (endless_value(setpoint) == 0 || !limit || now - *last_query_ < *limit) return;
    on_event(AngleEvent::kSilence);
    UnaskedMotion motion;
    motion.unread = motion.turns = motion.silent = true;
    motion.from = now;
    motion.frame = motion_.frame;
    motion.shaft_deg = servo.multi_turn_deg(lane.telemetry());
    return begin(motion, lane);
  }
  // A protection has tripped, or the power is off.
  if (std::holds_alternative<model::Off>(setpoint) || !lane.bank.alive(lane.index)) {
    motion_.over = true;
    return;
  }
  const model::Truth truth = lane.bank.truth(lane.index);
  const double dps = std::abs(truth.omega_out) / kRadPerDeg;
  work_J_ += truth.tau_e * truth.omega_m * in_seconds(now - sampled_at_);
  sampled_at_ = now;
  motion_.deg = std::max(motion_.deg, std::abs(truth.theta_out - from_rad_) / kRadPerDeg);
  motion_.dps = std::max(motion_.dps, dps);
  motion_.J = std::max(motion_.J, work_J_);
  if (motion_.deg > worst_.deg) worst_ = motion_;
  dps_ = std::max(dps_, motion_.dps);
  J_ = std::max(J_, motion_.J);
  if (dps >= kRest_dps) moved_at_ = now;
  if (!motion_.silent && now - moved_at_ >= kRest) motion_.over = true;
}

}  // namespace lk::emulator
