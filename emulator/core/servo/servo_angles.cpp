/// @file Encoder and angles.

#include <algorithm>

#include "emulator/core/servo/servo_commands.hpp"
#include "protocol/wire.hpp"

namespace lk::emulator {

using protocol::Reply;

namespace {

constexpr RomParameter kOffsetAlone[] = {RomParameter::kEncoderOffset};

/// Returns the angle that 0x95 sets: the payload, or, without payload on RS-485, old bytes of the
/// receive buffer.
std::int64_t zero_ram_angle(const Servo& servo, const protocol::ClearAngle& command,
                            const Context& context) {
  const bool takes_what_is_left = servo.format.dialect.framing == protocol::Framing::kSerial &&
                                  servo.format.dialect.zero_ram_len > 0 && context.query.size == 1;
  return takes_what_is_left ? servo.left_in_buffer_cdeg : command.angle_cdeg;
}

}  // namespace

Reply execute(const Servo& servo, const protocol::ReadEncoder& command, const Context& context) {
  const std::int64_t position = servo.angles.position(context.before);
  return protocol::Encoder{
      .encoder_counts = servo.angles.encoder(position, servo.ram.encoder_offset),
      .raw_counts = servo.angles.raw(position),
      .offset_counts = servo.ram.encoder_offset,
      .type = command.type,
      .full_counts = servo.angles.in_full(position, command.type == protocol::kEncoderZeroed)};
}

Reply execute(Servo& servo, const protocol::WriteOffsetToRom& command, const Context& context) {
  Registers wanted = servo.rom;
  wanted.encoder_offset = std::min(command.offset_counts, servo.angles.max_wire_count());
  write_rom(servo, kOffsetAlone, wanted);
  if (servo.config.quirks.offset_write_takes_effect) {
    servo.ram.encoder_offset = wanted.encoder_offset;
    apply_offset(servo);
  }
  return echo(context);
}

/// The offset takes effect at the next start of the controller.
Reply execute(Servo& servo, const protocol::WriteZeroToRom&, const Context& context) {
  Registers wanted = servo.rom;
  wanted.encoder_offset = servo.angles.raw(servo.angles.position(context.before));
  write_rom(servo, kOffsetAlone, wanted);
  if (!servo.format.dialect.zero_answered &&
      servo.format.dialect.framing == protocol::Framing::kSerial) {
    return protocol::NoReply{};
  }
  return protocol::ZeroWritten{wanted.encoder_offset};
}

Reply execute(const Servo& servo, const protocol::ReadMultiTurnAngle&, const Context& context) {
  return protocol::MultiTurnAngle{
      servo.angles.multi_turn_cdeg(servo.angles.position(context.before))};
}

Reply execute(const Servo& servo, const protocol::ReadSingleTurnAngle&, const Context& context) {
  return protocol::SingleTurnAngle{
      servo.angles.single_turn_cdeg(servo.angles.position(context.before))};
}

Reply execute(Servo& servo, const protocol::ClearAngle& command, const Context& context) {
  const std::int64_t position = servo.angles.position(context.before);
  switch (servo.format.dialect.clear_angle) {
    case protocol::ClearAngleMeaning::kIgnored:
      break;
    case protocol::ClearAngleMeaning::kImplemented:
      servo.angles.clear(position);
      if (servo.motion.position) {
        servo.motion = {};
        if (servo.run_state == RunState::kRunning) {
          context.lane.command(servo.motion.setpoint);
        }
      }
      break;
    case protocol::ClearAngleMeaning::kSetsAngle:
      // A position command in force keeps its position on the shaft; only the angle of that
      // position changes. So the shaft does not move.
      servo.angles.set_multi_turn(position, zero_ram_angle(servo, command, context));
      servo.motion.multi_turn_cdeg.reset();
      break;
    case protocol::ClearAngleMeaning::kZero:
      servo.angles.set_multi_turn(position, 0);
      servo.motion.multi_turn_cdeg.reset();
      break;
  }
  if (servo.format.dialect.zero_stops) execute(servo, protocol::Stop{}, context);
  return echo(context);
}

Reply execute(Servo& servo, const protocol::ClearTurns&, const Context& context) {
  servo.angles.forget_turns(servo.angles.position(context.before));
  servo.motion.multi_turn_cdeg.reset();  // the requested angle is now another position
  return echo(context);
}

void keep_received(Servo& servo, const protocol::Frame& packet) {
  constexpr std::uint8_t kSevenBytes = 1 + 7;
  if (packet.dlc < kSevenBytes) return;
  servo.left_in_buffer_cdeg = protocol::get_le<std::int32_t>(packet.data, 4);
}

void apply_offset(Servo& servo) {
  servo.angles.set_offset(servo.ram.encoder_offset);
  servo.motion.single_turn.reset();  // the requested angle is now another position
}

void start_multi_turn(Servo& servo, const model::Telemetry& telemetry, BootMultiTurn from) {
  const std::int64_t position = servo.angles.position(telemetry);
  if (from == BootMultiTurn::kZero) {
    servo.angles.set_multi_turn(position, 0);
  } else {
    servo.angles.forget_turns(position);
  }
}

}  // namespace lk::emulator
