/// @file Motion commands of the servo: set points for the loops, and their limits.

#include <algorithm>
#include <cassert>

#include "emulator/core/servo/servo.hpp"
#include "emulator/core/units.hpp"
#include "protocol/rounding.hpp"

namespace lk::emulator {

using protocol::Opcode;
using protocol::Reply;

Reply Servo::on(const protocol::OpenLoop& command, const Context& context) {
  return execute(protocol::OpenLoop::kOpcode,
                 loop_motion(model::OpenLoop{command.power_permille * 1e-3}), context);
}

Reply Servo::on(const protocol::Torque& command, const Context& context) {
  return execute(protocol::Torque::kOpcode, loop_motion(model::Torque{command.iq_A}), context);
}

Reply Servo::on(const protocol::Speed& command, const Context& context) {
  const double omega = rad_s_from_dps(within_max_speed(command.speed_dps));
  Motion motion = loop_motion(model::Speed{omega, command.iq_limit_A});
  motion.speed_dps = command.speed_dps;
  return execute(protocol::Speed::kOpcode, motion, context);
}

Reply Servo::on(const protocol::Position1& command, const Context& context) {
  return execute(protocol::Position1::kOpcode, to_multi_turn(command.target_cdeg, 0), context);
}

Reply Servo::on(const protocol::Position2& command, const Context& context) {
  return execute(protocol::Position2::kOpcode,
                 to_multi_turn(command.target_cdeg, command.max_speed_dps), context);
}

Reply Servo::on(const protocol::Position3& command, const Context& context) {
  return execute(protocol::Position3::kOpcode, to_single_turn(command, 0, context), context);
}

Reply Servo::on(const protocol::Position4& command, const Context& context) {
  const protocol::Position3 request{command.direction, command.target_cdeg};
  return execute(protocol::Position4::kOpcode,
                 to_single_turn(request, command.max_speed_dps, context), context);
}

Reply Servo::on(const protocol::Position5& command, const Context& context) {
  return execute(protocol::Position5::kOpcode, by_increment(command.increment_cdeg, 0, context),
                 context);
}

Reply Servo::on(const protocol::Position6& command, const Context& context) {
  return execute(protocol::Position6::kOpcode,
                 by_increment(command.increment_cdeg, command.max_speed_dps, context), context);
}

std::optional<std::size_t> Servo::slot() const {
  const int slot = address() - protocol::kMinId;
  return slot < protocol::kMultiDriveSlots ? std::optional(static_cast<std::size_t>(slot))
                                           : std::nullopt;
}

// Without a slot the drive answers, but nothing changes.

Reply Servo::on(const protocol::MultiTorque& command, const Context& context) {
  const auto own = slot();
  return own ? on(protocol::Torque{command.iq_A[*own]}, context)
             : state_2(protocol::Torque::kOpcode, context.before);
}

Reply Servo::on(const protocol::MultiSpeed& command, const Context& context) {
  const auto own = slot();
  return own ? on(protocol::Speed{static_cast<double>(command.speed_dps[*own]), 0}, context)
             : state_2(protocol::Speed::kOpcode, context.before);
}

Reply Servo::on(const protocol::MultiPosition& command, const Context& context) {
  const auto own = slot();
  return own ? on(protocol::Position1{command.target_cdeg[*own]}, context)
             : state_2(protocol::Position1::kOpcode, context.before);
}

Reply Servo::on(const protocol::MultiCommand&, const Context& context) {
  assert(false && "understand() has put the slot's command in its place");
  return state_2(protocol::ReadState2::kOpcode, context.before);
}

Servo::Motion Servo::loop_motion(const model::Setpoint& setpoint) {
  Motion motion;
  motion.setpoint = setpoint;
  return motion;
}

double Servo::within_max_speed(double speed_dps) const {
  return format_.dialect.speed_iq_limit
             ? std::clamp(speed_dps, -ram_.max_speed_dps, ram_.max_speed_dps)
             : speed_dps;
}

std::int64_t Servo::within_max_angle(std::int64_t target_cdeg) const {
  if (ram_.max_angle_deg <= 0) {
    return target_cdeg;
  }
  const std::int64_t limit_cdeg = protocol::rounded(ram_.max_angle_deg * 100);
  return std::clamp(target_cdeg, -limit_cdeg, limit_cdeg);
}

void Servo::reapply_limits(const Lane& lane) {
  turn_off_after_trip(lane.telemetry());  // a trip since the last query
  if (motion_.speed_dps) {
    std::get<model::Speed>(motion_.setpoint).omega =
        rad_s_from_dps(within_max_speed(*motion_.speed_dps));
  }
  if (motion_.multi_turn_cdeg) {
    motion_.position = angles_.multi_turn_target(within_max_angle(*motion_.multi_turn_cdeg));
    std::get<model::Position>(motion_.setpoint).theta = angles_.theta(*motion_.position);
  }
  if (run_state_ == RunState::kRunning && !calibrating()) {
    lane.command(motion_.setpoint);
  }
}

Servo::Motion Servo::to_position(const CommandedPosition& position, double max_speed_dps) const {
  // The loops also apply Max Speed, with its value at that time.
  Motion motion =
      loop_motion(model::Position{angles_.theta(position), rad_s_from_dps(max_speed_dps)});
  motion.position = position;
  return motion;
}

Servo::Motion Servo::to_multi_turn(std::int64_t target_cdeg, double max_speed_dps) const {
  // RS-485 has 64 bits for it; targets are limited to the range of 0x92.
  target_cdeg = std::clamp(target_cdeg, protocol::kInt56Min, protocol::kInt56Max);
  Motion motion =
      to_position(angles_.multi_turn_target(within_max_angle(target_cdeg)), max_speed_dps);
  motion.multi_turn_cdeg = target_cdeg;
  return motion;
}

std::optional<Servo::Motion> Servo::to_single_turn(const protocol::Position3& request,
                                                   double max_speed_dps,
                                                   const Context& context) const {
  const bool clockwise = request.direction == protocol::kClockwise;
  if ((!clockwise && request.direction != protocol::kCounterClockwise) ||
      request.target_cdeg >= angles_.circle_cdeg()) {
    return std::nullopt;
  }
  // A host that repeats a target every millisecond means the same position, even after an
  // overshoot. After a stop the drive chooses the position again.
  const bool repeated =
      run_state_ == RunState::kRunning && motion_.position && motion_.single_turn == request;
  Motion motion =
      to_position(repeated ? *motion_.position
                           : angles_.single_turn_target(angles_.position(context.before), clockwise,
                                                        request.target_cdeg),
                  max_speed_dps);
  motion.single_turn = request;
  return motion;
}

Servo::Motion Servo::by_increment(std::int32_t increment_cdeg, double max_speed_dps,
                                  const Context& context) const {
  CommandedPosition target =
      motion_.position.value_or(angles_.at(angles_.position(context.before)));
  target.angle_cdeg += increment_cdeg;
  return to_position(target, max_speed_dps);
}

Reply Servo::execute(Opcode command, const std::optional<Motion>& motion, const Context& context) {
  if (!motion) {
    ++stats_.invalid_targets;
  } else if (run_state_ == RunState::kOff && (tripped_ || config_.quirks.off_needs_run)) {
    ++stats_.refused_motion;
  } else if (calibrating()) {
    ++stats_.refused_motion;
  } else if (loses_next_) {
    loses_next_ = false;
    shown_faults_.first_command_lost = true;
  } else {
    motion_ = *motion;
    run_state_ = RunState::kRunning;
    context.lane.command(motion_.setpoint);
  }
  return state_2(command, context.before);
}

}  // namespace lk::emulator
