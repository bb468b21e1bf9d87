/// @file Run state, brake, errors and measured values.

#include <algorithm>

#include "emulator/core/servo/servo_commands.hpp"
#include "emulator/core/units.hpp"
#include "protocol/field_values.hpp"
#include "protocol/rounding.hpp"

namespace lk::emulator {

using protocol::Opcode;
using protocol::Reply;

namespace {

/// Error bits that `legacy` replies show: under-voltage and motor over-temperature. The other
/// errors also turn the bridge off, but no reply shows them.
constexpr model::ErrorBits kLegacyErrors =
    model::bit(model::Error::kUnderVoltage) | model::bit(model::Error::kMotorTemperature);

/// Returns DATA[0] of the reply: DATA[0] of the query, or the misprint of the manual.
Opcode reply_opcode(const Servo& servo, Opcode command) {
  if (!servo.config.quirks.manual_reply_bytes ||
      servo.format.dialect.framing == protocol::Framing::kSerial) {
    return command;
  }
  const Opcode printed = protocol::find_command(static_cast<std::uint8_t>(command))->printed;
  return printed != Opcode{} ? printed : command;
}

}  // namespace

Reply execute(Servo& servo, const protocol::Off&, const Context& context) {
  servo.run_state = RunState::kOff;
  servo.motion = {};
  const Quirks& quirks = servo.config.quirks;
  start_multi_turn(servo, context.before,
                   quirks.off_multi_turn == OffMultiTurn::kAsBoot ? quirks.boot_multi_turn
                                                                  : BootMultiTurn::kSingleTurn);
  context.lane.command(model::Off{});
  arm_command_loss(servo, LostAfter::kOff);
  servo.hung = std::max({servo.hung, quirks.off_hangs, servo.faults.off_hangs});
  return echo(context);
}

Reply execute(Servo& servo, const protocol::Stop&, const Context& context) {
  if (servo.run_state == RunState::kRunning) {
    servo.run_state = RunState::kStopped;
    if (servo.config.quirks.stop_holds) {
      const auto here = servo.angles.at(servo.angles.position(context.before));
      context.lane.command(model::Position{servo.angles.theta(here), 0});
    } else {
      context.lane.command(model::Idle{});
    }
  }
  return echo(context);
}

Reply execute(Servo& servo, const protocol::Run&, const Context& context) {
  const bool resumes = servo.run_state == RunState::kStopped && servo.config.quirks.run_resumes;
  if (servo.run_state != RunState::kRunning && context.before.errors == 0) {
    if (!resumes) {
      servo.motion = {};
    }
    servo.run_state = RunState::kRunning;
    servo.tripped = false;
    context.lane.command(servo.motion.setpoint);
  }
  return echo(context);
}

/// The reply shows the state of the coil after the command.
Reply execute(Servo& servo, const protocol::Brake& command, const Context& context) {
  switch (command.action) {
    case protocol::kBrakeEngage:
    case protocol::kBrakeRelease:
      servo.brake_powered = command.action == protocol::kBrakeRelease;
      context.lane.set_brake_coil(servo.brake_powered);
      break;
    case protocol::kBrakeRead:
      break;
    default:
      ++servo.stats.invalid_targets;
  }
  return protocol::BrakeState{servo.brake_powered};
}

Reply execute(Servo& servo, const protocol::Restart&, const Context&) {
  servo.restart_pending = true;
  return protocol::NoReply{};
}

/// Updates the run state if a protection has tripped, which turns the bridge off and cancels the
/// command. Only 0x9B followed by 0x88 makes the drive run again.
void turn_off_after_trip(Servo& servo, const model::Telemetry& telemetry) {
  if (telemetry.errors != 0) {
    servo.run_state = RunState::kOff;
    servo.tripped = true;
    servo.motion = {};
  }
  if ((telemetry.errors & model::bit(model::Error::kLostInput)) != 0) {
    arm_command_loss(servo, LostAfter::kLostInput);
  }
}

Reply execute(const Servo& servo, const protocol::ReadState1&, const Context& context) {
  return state_1_reply(servo, protocol::ReadState1::kOpcode, context.before);
}

Reply execute(Servo& servo, const protocol::ClearErrors&, const Context& context) {
  context.lane.clear_errors();
  arm_command_loss(servo, LostAfter::kClear);
  const model::Telemetry after = context.lane.telemetry();
  if (!servo.clear_reply_before())
    return state_1_reply(servo, protocol::ClearErrors::kOpcode, after);
  servo.effective_faults.clear_reply_before |= context.before.errors != after.errors;
  return state_1_reply(servo, protocol::ClearErrors::kOpcode, context.before);
}

Reply execute(const Servo& servo, const protocol::ReadState2&, const Context& context) {
  return state_2_reply(servo, protocol::ReadState2::kOpcode, context.before);
}

Reply execute(const Servo&, const protocol::ReadState3&, const Context& context) {
  const model::Telemetry& before = context.before;
  return protocol::State3{before.temp_motor, before.i_a, before.i_b, before.i_c};
}

Reply state_1_reply(const Servo& servo, Opcode command, const model::Telemetry& telemetry) {
  const model::ErrorBits shown =
      servo.format.dialect.all_error_bits ? model::ErrorBits{0xFF} : kLegacyErrors;
  return protocol::State1{.command = reply_opcode(servo, command),
                          .temperature_C = telemetry.temp_motor,
                          .voltage_V = telemetry.v_bus,
                          .errors = static_cast<std::uint8_t>(telemetry.errors & shown),
                          .bus_current_A = telemetry.i_bus,
                          .bridge_on = servo.run_state != RunState::kOff};
}

Reply state_2_reply(const Servo& servo, Opcode command, const model::Telemetry& telemetry) {
  return protocol::State2{
      .command = reply_opcode(servo, command),
      .temperature_C = telemetry.temp_motor,
      .iq_A = telemetry.i_q,
      .speed_dps = dps_from_rad_s(telemetry.omega),
      .encoder_counts =
          servo.angles.encoder(servo.angles.position(telemetry), servo.ram.encoder_offset),
      .power_permille = protocol::quantize<std::int16_t>(telemetry.power, 1e-3)};
}

}  // namespace lk::emulator
