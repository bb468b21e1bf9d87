/// @file Motion commands: set points for the loops, and their limits. Also the calibration, which
/// turns the shaft.

#include <algorithm>
#include <cassert>
#include <chrono>
#include <cmath>
#include <numbers>
#include <utility>

#include "emulator/core/servo/servo_commands.hpp"
#include "emulator/core/units.hpp"
#include "protocol/rounding.hpp"

namespace lk::emulator {

using protocol::Opcode;
using protocol::Reply;

namespace {

constexpr double kCalibrationTurns = 2;  // electrical turns in each direction; our choice
// Limits of measured to commanded travel, ‰; our choice. A ratio out of this range means that the
// encoder does not follow the windings.
constexpr double kLeastAlignRatio = 900, kMaxAlignRatio = 1100;

/// Index of this drive in multi-drive commands; nullopt above ID 4.
std::optional<std::size_t> slot_of(const Servo& servo) {
  const int slot = servo.address() - protocol::kMinId;
  return slot < protocol::kMultiDriveSlots ? std::optional(static_cast<std::size_t>(slot))
                                           : std::nullopt;
}

Motion loop_motion(const model::Setpoint& setpoint) {
  Motion motion;
  motion.setpoint = setpoint;
  return motion;
}

double within_max_speed(const Servo& servo, double speed_dps) {
  return servo.format.dialect.speed_iq_limit
             ? std::clamp(speed_dps, -servo.ram.max_speed_dps, servo.ram.max_speed_dps)
             : speed_dps;
}

std::int64_t within_max_angle(const Servo& servo, std::int64_t target_cdeg) {
  if (servo.ram.max_angle_deg <= 0) {
    return target_cdeg;
  }
  const std::int64_t limit_cdeg = protocol::rounded(servo.ram.max_angle_deg * 100);
  return std::clamp(target_cdeg, -limit_cdeg, limit_cdeg);
}

Motion to_position(const Servo& servo, const CommandedPosition& position, double max_speed_dps) {
  // The control loops also apply Max Speed, with the value in the register at each time.
  Motion motion =
      loop_motion(model::Position{servo.angles.theta(position), rad_s_from_dps(max_speed_dps)});
  motion.position = position;
  return motion;
}

Motion to_multi_turn(const Servo& servo, std::int64_t target_cdeg, double max_speed_dps) {
  // RS-485 has 64 bits for the target; it is limited to the range that 0x92 can report.
  target_cdeg = std::clamp(target_cdeg, protocol::kInt56Min, protocol::kInt56Max);
  Motion motion = to_position(
      servo, servo.angles.multi_turn_target(within_max_angle(servo, target_cdeg)), max_speed_dps);
  motion.multi_turn_cdeg = target_cdeg;
  return motion;
}

std::optional<Motion> to_single_turn(const Servo& servo, const protocol::Position3& request,
                                     double max_speed_dps, const Context& context) {
  const bool clockwise = request.direction == protocol::kClockwise;
  if ((!clockwise && request.direction != protocol::kCounterClockwise) ||
      request.target_cdeg >= servo.angles.circle_cdeg()) {
    return std::nullopt;
  }
  // A host that repeats a target every millisecond means the same position, even after an overshoot
  // of the shaft. After a stop the drive selects the position again.
  const bool repeated = servo.run_state == RunState::kRunning && servo.motion.position &&
                        servo.motion.single_turn == request;
  Motion motion =
      to_position(servo,
                  repeated ? *servo.motion.position
                           : servo.angles.single_turn_target(servo.angles.position(context.before),
                                                             clockwise, request.target_cdeg),
                  max_speed_dps);
  motion.single_turn = request;
  return motion;
}

Motion by_increment(const Servo& servo, std::int32_t increment_cdeg, double max_speed_dps,
                    const Context& context) {
  CommandedPosition target =
      servo.motion.position.value_or(servo.angles.at(servo.angles.position(context.before)));
  target.angle_cdeg += increment_cdeg;
  return to_position(servo, target, max_speed_dps);
}

/// Starts `motion`, unless it is absent (invalid target) or refused. Returns state 2 in any case.
Reply start_motion(Servo& servo, Opcode command, const std::optional<Motion>& motion,
                   const Context& context) {
  if (!motion) {
    ++servo.stats.invalid_targets;
  } else if (servo.run_state == RunState::kOff &&
             (servo.tripped || servo.config.quirks.off_needs_run)) {
    ++servo.stats.refused_motion;
  } else if (servo.calibrating()) {
    ++servo.stats.refused_motion;
  } else if (servo.loses_next) {
    servo.loses_next = false;
    servo.effective_faults.first_command_lost = true;
  } else {
    servo.motion = *motion;
    servo.run_state = RunState::kRunning;
    context.lane.command(servo.motion.setpoint);
  }
  return state_2_reply(servo, command, context.before);
}

/// Returns the electrical speed, rad/s: kCalibrationTurns in half of the calibration time.
double calibration_speed(const Servo& servo) {
  const double half_s = 0.5 * in_seconds(servo.config.calibrate_time);
  return kCalibrationTurns * 2 * std::numbers::pi / half_s;
}

}  // namespace

Reply execute(Servo& servo, const protocol::OpenLoop& command, const Context& context) {
  return start_motion(servo, protocol::OpenLoop::kOpcode,
                      loop_motion(model::OpenLoop{command.power_permille * 1e-3}), context);
}

Reply execute(Servo& servo, const protocol::Torque& command, const Context& context) {
  return start_motion(servo, protocol::Torque::kOpcode, loop_motion(model::Torque{command.iq_A}),
                      context);
}

Reply execute(Servo& servo, const protocol::Speed& command, const Context& context) {
  const double omega = rad_s_from_dps(within_max_speed(servo, command.speed_dps));
  Motion motion = loop_motion(model::Speed{omega, command.iq_limit_A});
  motion.speed_dps = command.speed_dps;
  return start_motion(servo, protocol::Speed::kOpcode, motion, context);
}

Reply execute(Servo& servo, const protocol::Position1& command, const Context& context) {
  return start_motion(servo, protocol::Position1::kOpcode,
                      to_multi_turn(servo, command.target_cdeg, 0), context);
}

Reply execute(Servo& servo, const protocol::Position2& command, const Context& context) {
  return start_motion(servo, protocol::Position2::kOpcode,
                      to_multi_turn(servo, command.target_cdeg, command.max_speed_dps), context);
}

Reply execute(Servo& servo, const protocol::Position3& command, const Context& context) {
  return start_motion(servo, protocol::Position3::kOpcode,
                      to_single_turn(servo, command, 0, context), context);
}

Reply execute(Servo& servo, const protocol::Position4& command, const Context& context) {
  const protocol::Position3 request{command.direction, command.target_cdeg};
  return start_motion(servo, protocol::Position4::kOpcode,
                      to_single_turn(servo, request, command.max_speed_dps, context), context);
}

Reply execute(Servo& servo, const protocol::Position5& command, const Context& context) {
  return start_motion(servo, protocol::Position5::kOpcode,
                      by_increment(servo, command.increment_cdeg, 0, context), context);
}

Reply execute(Servo& servo, const protocol::Position6& command, const Context& context) {
  return start_motion(servo, protocol::Position6::kOpcode,
                      by_increment(servo, command.increment_cdeg, command.max_speed_dps, context),
                      context);
}

// A drive without a slot (ID above 4) answers, but executes no command.

Reply execute(Servo& servo, const protocol::MultiTorque& command, const Context& context) {
  const auto own = slot_of(servo);
  return own ? execute(servo, protocol::Torque{command.iq_A[*own]}, context)
             : state_2_reply(servo, protocol::Torque::kOpcode, context.before);
}

Reply execute(Servo& servo, const protocol::MultiSpeed& command, const Context& context) {
  const auto own = slot_of(servo);
  return own ? execute(servo, protocol::Speed{static_cast<double>(command.speed_dps[*own]), 0},
                       context)
             : state_2_reply(servo, protocol::Speed::kOpcode, context.before);
}

Reply execute(Servo& servo, const protocol::MultiPosition& command, const Context& context) {
  const auto own = slot_of(servo);
  return own ? execute(servo, protocol::Position1{command.target_cdeg[*own]}, context)
             : state_2_reply(servo, protocol::Position1::kOpcode, context.before);
}

Reply execute(const Servo& servo, const protocol::MultiCommand&, const Context& context) {
  assert(false && "understand() has put the slot's command in its place");
  return state_2_reply(servo, protocol::ReadState2::kOpcode, context.before);
}

void reapply_limits(Servo& servo, const Lane& lane) {
  turn_off_after_trip(servo, lane.telemetry());  // a trip since the last query
  if (servo.motion.speed_dps) {
    std::get<model::Speed>(servo.motion.setpoint).omega =
        rad_s_from_dps(within_max_speed(servo, *servo.motion.speed_dps));
  }
  if (servo.motion.multi_turn_cdeg) {
    servo.motion.position =
        servo.angles.multi_turn_target(within_max_angle(servo, *servo.motion.multi_turn_cdeg));
    std::get<model::Position>(servo.motion.setpoint).theta =
        servo.angles.theta(*servo.motion.position);
  }
  if (servo.run_state == RunState::kRunning && !servo.calibrating()) {
    lane.command(servo.motion.setpoint);
  }
}

// --- calibration ---

Reply execute(Servo& servo, const protocol::Calibrate&, const Context& context) {
  if (servo.calibrating()) return protocol::NoReply{};  // the running calibration continues
  if (servo.run_state == RunState::kOff || context.before.errors != 0)
    return protocol::Calibrated{};
  servo.motion = {};
  servo.run_state = RunState::kRunning;
  servo.calibration =
      Calibration{.turned_back = false, .from = servo.angles.position(context.before)};
  context.lane.command(model::Lead{calibration_speed(servo)});
  return protocol::NoReply{};
}

bool turn_back(Servo& servo, const Lane& lane) {
  const model::Telemetry now = lane.telemetry();
  turn_off_after_trip(servo, now);
  if (!servo.calibration || servo.calibration->turned_back || servo.run_state != RunState::kRunning)
    return false;
  const std::int64_t position = servo.angles.position(now);
  servo.calibration->travel += std::abs(position - servo.calibration->from);
  servo.calibration->from = position;
  servo.calibration->turned_back = true;
  lane.command(model::Lead{-calibration_speed(servo)});
  return true;
}

Reply finish_calibration(Servo& servo, const Lane& lane, std::uint64_t random) {
  const model::Telemetry now = lane.telemetry();
  turn_off_after_trip(servo, now);
  ++servo.stats.replies;
  Calibration done = *std::exchange(servo.calibration, std::nullopt);
  if (servo.run_state != RunState::kRunning || !done.turned_back) return protocol::Calibrated{};
  lane.command(model::Idle{});
  done.travel += std::abs(servo.angles.position(now) - done.from);
  const model::DriveParams& drive = servo.config.profile.drive;
  const auto counts = static_cast<double>(std::int64_t{1} << drive.encoder.bits);
  const double commanded = 2 * kCalibrationTurns * counts / drive.motor.pole_pairs;
  const double ratio = std::min(1000 * static_cast<double>(done.travel) / commanded, 65535.0);
  protocol::Calibrated reply{
      .align_value = static_cast<std::uint32_t>(random % static_cast<std::uint64_t>(counts)),
      .align_ratio = static_cast<std::uint16_t>(protocol::rounded(ratio))};
  if (drive.encoder.direction < 0) reply.status |= protocol::kPhasesReversed;
  if (ratio < kLeastAlignRatio || ratio > kMaxAlignRatio) return reply;
  reply.status |= protocol::kCalibrationDone;
  Registers wanted = servo.rom;
  wanted.align_value = static_cast<std::int32_t>(reply.align_value);
  servo.ram.align_value = wanted.align_value;
  constexpr RomParameter kAlign = RomParameter::kAlignValue;
  write_rom(servo, {&kAlign, 1}, wanted);
  return reply;
}

}  // namespace lk::emulator
