#include "emulator/servo.hpp"

#include <algorithm>
#include <cmath>

#include "emulator/registers.hpp"
#include "emulator/seed.hpp"
#include "emulator/units.hpp"

namespace lk::emulator {

using protocol::Opcode;
using protocol::Reply;

namespace {

/// Bits of errorState that this generation shows: under-voltage and motor over-temperature. The
/// others turn the bridge off just the same.
constexpr model::ErrorBits kShownErrors =
    model::bit(model::Error::kUnderVoltage) | model::bit(model::Error::kMotorTemperature);

// A shaft at rest on zero answers 0x92 with a copy of the query, which hosts take for an echo. A
// drawn boot angle keeps clear of that.
constexpr double kBootAngleMargin_deg = 5;

double boot_angle_deg(const ServoConfig& config, std::uint64_t bus_seed) {
  const double drawn = uniform(stream_seed(bus_seed, config.id, SeedStream::kBootAngle));
  return config.boot_angle_deg.value_or(kBootAngleMargin_deg +
                                        drawn * (360 - 2 * kBootAngleMargin_deg));
}

Reply echo(const protocol::Payload& request) { return protocol::Echo{request}; }

}  // namespace

model::DriveInit make_drive(const ServoConfig& config, std::uint64_t bus_seed) {
  ShaftAngles angles(config.profile);
  angles.set_offset(config.boot_offset.value_or(config.rom.encoder_offset));
  return {.params = config.profile.drive,
          .settings = control_settings(config.rom),
          .seed = stream_seed(bus_seed, config.id, SeedStream::kNoise),
          .theta_m = angles.theta_m_at(boot_angle_deg(config, bus_seed))};
}

Servo::Servo(const ServoConfig& config, const model::Telemetry& boot)
    : config_(config), rom_(config.rom), wear_(config.wear), angles_(config.profile) {
  wake_up(boot);
}

void Servo::wake_up(const model::Telemetry& telemetry) {
  ram_ = rom_;
  angles_.set_offset(ram_.encoder_offset);
  angles_.forget_turns(angles_.position(telemetry));
  run_state_ = RunState::kRunning;
  motion_ = {};
}

void Servo::power_cycle(const Lane& lane) {
  wake_up(lane.telemetry());
  lane.configure(control_settings(ram_));
  lane.clear_errors();
  lane.command(model::Idle{});
}

Reply Servo::handle(const protocol::Query& query, const Lane& lane) {
  const model::Telemetry before = lane.telemetry();
  lay_down_after_trip(before);
  lane.feed_input();
  ++stats_.queries;
  const Context context{query.data, before, lane};
  const Reply reply =
      std::visit([&](const auto& command) { return on(command, context); }, query.command);
  ++stats_.replies;
  return reply;
}

/// A protection that tripped has turned the bridge off and dropped the command; only 0x9B and then
/// 0x88 bring the drive back.
void Servo::lay_down_after_trip(const model::Telemetry& telemetry) {
  if (telemetry.errors != 0) {
    run_state_ = RunState::kOff;
    motion_ = {};
  }
}

// --- registers
// -------------------------------------------------------------------------------------

Reply Servo::on(const protocol::ReadPid&, const Context&) const {
  const auto& gains = ram_.gains;
  // A byte has no room for what 0xC1 may have written.
  const auto byte = [](std::uint16_t gain) {
    return static_cast<std::uint8_t>(std::min<std::uint16_t>(gain, 255));
  };
  return protocol::Pid{{byte(gains.angle_kp), byte(gains.angle_ki), byte(gains.speed_kp),
                        byte(gains.speed_ki), byte(gains.current_kp), byte(gains.current_ki)}};
}

Reply Servo::on(const protocol::WritePidToRam& command, const Context& context) {
  const auto& gains = command.gains;
  ram_.gains = {gains.angle_kp, gains.angle_ki, gains.speed_kp,
                gains.speed_ki, gains.iq_kp,    gains.iq_ki};
  context.lane.configure(control_settings(ram_));
  return echo(context.request);
}

Reply Servo::on(const protocol::WritePidToRom& command, const Context& context) {
  on(protocol::WritePidToRam{command.gains}, context);
  Registers wanted = rom_;
  wanted.gains = ram_.gains;
  write_rom(RomParameter::kGains, wanted);
  return echo(context.request);
}

Reply Servo::on(const protocol::ReadAcceleration&, const Context&) const {
  return protocol::Acceleration{ram_.acceleration_dps_s};
}

Reply Servo::on(const protocol::WriteAccelerationToRam& command, const Context& context) {
  ram_.acceleration_dps_s = std::max(command.acceleration_dps_s, 0);
  context.lane.configure(control_settings(ram_));
  return echo(context.request);
}

Reply Servo::on(const protocol::WriteOffsetToRom& command, const Context& context) {
  Registers wanted = rom_;
  wanted.encoder_offset = std::min(command.offset_counts, angles_.max_wire_count());
  write_rom(RomParameter::kEncoderOffset, wanted);
  if (config_.quirks.offset_write_takes_effect) {
    ram_.encoder_offset = wanted.encoder_offset;
    angles_.set_offset(ram_.encoder_offset);
    motion_.single_turn.reset();  // the same target is another place from now on
  }
  return echo(context.request);
}

/// In force after the next power-up only.
Reply Servo::on(const protocol::WriteZeroToRom&, const Context& context) {
  Registers wanted = rom_;
  wanted.encoder_offset = angles_.raw(angles_.position(context.before));
  write_rom(RomParameter::kEncoderOffset, wanted);
  return protocol::ZeroWritten{wanted.encoder_offset};
}

/// Worn cells keep what they have; the firmware does not look, so the reply is the same.
void Servo::write_rom(RomParameter parameter, const Registers& rom) {
  std::uint32_t& writes = wear_[static_cast<std::size_t>(parameter)];
  ++stats_.rom_writes;
  if (writes >= config_.flash.endurance) {
    return;
  }
  ++writes;
  rom_ = rom;
}

// --- angles and states
// -----------------------------------------------------------------------------

Reply Servo::on(const protocol::ReadEncoder&, const Context& context) const {
  const std::int64_t position = angles_.position(context.before);
  return protocol::Encoder{angles_.encoder(position, ram_.encoder_offset), angles_.raw(position),
                           ram_.encoder_offset};
}

Reply Servo::on(const protocol::ReadMultiTurnAngle&, const Context& context) const {
  return protocol::MultiTurnAngle{angles_.multi_turn_cdeg(angles_.position(context.before))};
}

Reply Servo::on(const protocol::ReadSingleTurnAngle&, const Context& context) const {
  return protocol::SingleTurnAngle{angles_.single_turn_cdeg(angles_.position(context.before))};
}

Reply Servo::on(const protocol::ClearAngle&, const Context& context) {
  if (config_.quirks.dialect.clear_angle == protocol::ClearAngleMeaning::kImplemented) {
    angles_.clear(angles_.position(context.before));
    if (motion_.position) {
      motion_ = {};
      if (run_state_ == RunState::kRunning) {
        context.lane.command(motion_.setpoint);
      }
    }
  }
  return echo(context.request);
}

Reply Servo::on(const protocol::ReadState1&, const Context& context) const {
  return state_1(Opcode::kReadState1, context.before);
}

Reply Servo::on(const protocol::ClearErrors&, const Context& context) {
  context.lane.clear_errors();
  return state_1(Opcode::kClearErrors, context.lane.telemetry());
}

Reply Servo::on(const protocol::ReadState2&, const Context& context) const {
  return state_2(Opcode::kReadState2, context.before);
}

Reply Servo::on(const protocol::ReadState3&, const Context& context) const {
  const model::Telemetry& before = context.before;
  return protocol::State3{before.temp_motor, before.i_a, before.i_b, before.i_c};
}

// --- run state
// -------------------------------------------------------------------------------------

Reply Servo::on(const protocol::Off&, const Context& context) {
  run_state_ = RunState::kOff;
  motion_ = {};
  angles_.forget_turns(angles_.position(context.before));
  context.lane.command(model::Off{});
  return echo(context.request);
}

Reply Servo::on(const protocol::Stop&, const Context& context) {
  if (run_state_ == RunState::kRunning) {
    run_state_ = RunState::kStopped;
    if (config_.quirks.stop_holds) {
      const auto here = angles_.at(angles_.position(context.before));
      context.lane.command(model::Position{angles_.theta(here), 0});
    } else {
      context.lane.command(model::Idle{});
    }
  }
  return echo(context.request);
}

Reply Servo::on(const protocol::Run&, const Context& context) {
  const bool resumes = run_state_ == RunState::kStopped && config_.quirks.run_resumes;
  if (run_state_ != RunState::kRunning && context.before.errors == 0) {
    if (!resumes) {
      motion_ = {};
    }
    run_state_ = RunState::kRunning;
    context.lane.command(motion_.setpoint);
  }
  return echo(context.request);
}

// --- motion
// ----------------------------------------------------------------------------------------

Reply Servo::on(const protocol::Torque& command, const Context& context) {
  return execute(Opcode::kTorque, loop_motion(model::Torque{command.iq_A}), context);
}

Reply Servo::on(const protocol::Speed& command, const Context& context) {
  const double omega = rad_s_from_dps(command.speed_dps);
  return execute(Opcode::kSpeed, loop_motion(model::Speed{omega, 0}), context);
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

Reply Servo::on(const protocol::MultiTorque& command, const Context& context) {
  const auto slot = static_cast<std::size_t>(id() - protocol::kMinId);
  if (slot >= command.iq_A.size()) {
    return state_2(Opcode::kTorque, context.before);  // no slot: answers, and nothing changes
  }
  return on(protocol::Torque{command.iq_A[slot]}, context);
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
      request.target_cdeg >= protocol::kTurn_cdeg) {
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

// --- common replies
// --------------------------------------------------------------------------------

Reply Servo::state_1(Opcode command, const model::Telemetry& telemetry) const {
  return protocol::State1{.command = reply_opcode(command),
                          .temperature_C = telemetry.temp_motor,
                          .voltage_V = telemetry.v_bus,
                          .errors = static_cast<std::uint8_t>(telemetry.errors & kShownErrors)};
}

Reply Servo::state_2(Opcode command, const model::Telemetry& telemetry) const {
  // MS drives have no current sensors: their field carries the duty of the bus voltage, per mille.
  const double power_as_iq_A = telemetry.power * 1000 * protocol::kLegacyFormat.iq_reply_lsb_A;
  return protocol::State2{
      .command = reply_opcode(command),
      .temperature_C = telemetry.temp_motor,
      .iq_A = config_.profile.series == Series::kMs ? power_as_iq_A : telemetry.i_q,
      .speed_dps = dps_from_rad_s(telemetry.omega),
      .encoder_counts = angles_.encoder(angles_.position(telemetry), ram_.encoder_offset)};
}

/// DATA[0] of the reply: that of the query, or what the manual misprints.
Opcode Servo::reply_opcode(Opcode command) const {
  if (config_.quirks.manual_reply_bytes) {
    if (command == Opcode::kClearErrors) {
      return Opcode::kReadState1;
    }
    if (command == Opcode::kPosition5) {
      return Opcode::kPosition3;
    }
    if (command == Opcode::kPosition6) {
      return Opcode::kPosition4;
    }
  }
  return command;
}

}  // namespace lk::emulator
