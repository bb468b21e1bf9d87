/// @file The servo's motion commands: which setpoint they give the loops, and within which limits.

#include <algorithm>
#include <cassert>
#include <cmath>

#include "emulator/servo.hpp"
#include "emulator/units.hpp"

namespace lk::emulator {

using protocol::Opcode;
using protocol::Reply;

Reply Servo::on(const protocol::OpenLoop& command, const Context& context) {
  return execute(Opcode::kOpenLoop, loop_motion(model::OpenLoop{command.power_permille * 1e-3}),
                 context);
}

Reply Servo::on(const protocol::Torque& command, const Context& context) {
  return execute(Opcode::kTorque, loop_motion(model::Torque{command.iq_A}), context);
}

Reply Servo::on(const protocol::Speed& command, const Context& context) {
  double speed_dps = command.speed_dps;
  if (format_.dialect.speed_iq_limit) {
    speed_dps = std::clamp(speed_dps, -ram_.max_speed_dps, ram_.max_speed_dps);
  }
  // MS drives know no current; their limit is Max Power.
  const double iq_limit_A = format_.series == Series::kMs ? 0 : command.iq_limit_A;
  return execute(Opcode::kSpeed, loop_motion(model::Speed{rad_s_from_dps(speed_dps), iq_limit_A}),
                 context);
}

Reply Servo::on(const protocol::Position1& command, const Context& context) {
  return execute(Opcode::kPosition1, to_multi_turn(command.target_cdeg, 0), context);
}

Reply Servo::on(const protocol::Position2& command, const Context& context) {
  return execute(Opcode::kPosition2, to_multi_turn(command.target_cdeg, command.max_speed_dps),
                 context);
}

Reply Servo::on(const protocol::Position3& command, const Context& context) {
  return execute(Opcode::kPosition3, to_single_turn(command, 0, context), context);
}

Reply Servo::on(const protocol::Position4& command, const Context& context) {
  const protocol::Position3 request{command.direction, command.target_cdeg};
  return execute(Opcode::kPosition4, to_single_turn(request, command.max_speed_dps, context),
                 context);
}

Reply Servo::on(const protocol::Position5& command, const Context& context) {
  return execute(Opcode::kPosition5, by_increment(command.increment_cdeg, 0, context), context);
}

Reply Servo::on(const protocol::Position6& command, const Context& context) {
  return execute(Opcode::kPosition6,
                 by_increment(command.increment_cdeg, command.max_speed_dps, context), context);
}

std::optional<std::size_t> Servo::slot() const {
  const int slot = id() - protocol::kMinId;
  return slot < protocol::kMultiDriveSlots ? std::optional(static_cast<std::size_t>(slot))
                                           : std::nullopt;
}

// Without a slot the drive answers, and nothing changes.

Reply Servo::on(const protocol::MultiTorque& command, const Context& context) {
  const auto own = slot();
  return own ? on(protocol::Torque{command.iq_A[*own]}, context)
             : state_2(Opcode::kTorque, context.before);
}

Reply Servo::on(const protocol::MultiSpeed& command, const Context& context) {
  const auto own = slot();
  return own ? on(protocol::Speed{static_cast<double>(command.speed_dps[*own]), 0}, context)
             : state_2(Opcode::kSpeed, context.before);
}

Reply Servo::on(const protocol::MultiPosition& command, const Context& context) {
  const auto own = slot();
  return own ? on(protocol::Position1{100 * command.target_deg[*own]}, context)
             : state_2(Opcode::kPosition1, context.before);
}

Reply Servo::on(const protocol::MultiCommand&, const Context& context) {
  assert(false && "understand() has put the slot's command in its place");
  return state_2(Opcode::kReadState2, context.before);
}

Servo::Motion Servo::loop_motion(const model::Setpoint& setpoint) {
  return {.setpoint = setpoint, .position = std::nullopt, .single_turn = std::nullopt};
}

Servo::Motion Servo::to_position(const CommandedPosition& position,
                                 std::uint16_t max_speed_dps) const {
  const double max_dps = std::min(static_cast<double>(max_speed_dps), ram_.max_speed_dps);
  return {.setpoint = model::Position{angles_.theta(position), rad_s_from_dps(max_dps)},
          .position = position,
          .single_turn = std::nullopt};
}

Servo::Motion Servo::to_multi_turn(std::int32_t target_cdeg, std::uint16_t max_speed_dps) const {
  std::int64_t held_cdeg = target_cdeg;
  if (ram_.max_angle_deg > 0) {
    const std::int64_t limit_cdeg = std::llround(ram_.max_angle_deg * 100);
    held_cdeg = std::clamp(held_cdeg, -limit_cdeg, limit_cdeg);
  }
  return to_position(angles_.multi_turn_target(held_cdeg), max_speed_dps);
}

std::optional<Servo::Motion> Servo::to_single_turn(const protocol::Position3& request,
                                                   std::uint16_t max_speed_dps,
                                                   const Context& context) const {
  const bool clockwise = request.direction == protocol::kClockwise;
  if ((!clockwise && request.direction != protocol::kCounterClockwise) ||
      request.target_cdeg >= angles_.circle_cdeg()) {
    return std::nullopt;
  }
  // A host that sends the same target every millisecond means the same place, also when the shaft
  // has swung past it. Once stopped, the drive travels anew.
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

Servo::Motion Servo::by_increment(std::int32_t increment_cdeg, std::uint16_t max_speed_dps,
                                  const Context& context) const {
  CommandedPosition target =
      motion_.position.value_or(angles_.at(angles_.position(context.before)));
  target.angle_cdeg += increment_cdeg;
  return to_position(target, max_speed_dps);
}

Reply Servo::execute(Opcode command, const std::optional<Motion>& motion, const Context& context) {
  if (!motion) {
    ++stats_.invalid_targets;
  } else if (run_state_ == RunState::kOff) {
    ++stats_.refused_motion;
  } else {
    motion_ = *motion;
    run_state_ = RunState::kRunning;
    context.lane.command(motion_.setpoint);
  }
  return state_2(command, context.before);
}

}  // namespace lk::emulator
