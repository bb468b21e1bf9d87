/// @file Registers and angles of the servo, and the commands for them.

#include <algorithm>

#include "emulator/core/servo/registers.hpp"
#include "emulator/core/servo/servo.hpp"

namespace lk::emulator {

using protocol::Echo;
using protocol::Reply;

namespace {

constexpr RomParameter kGainsAlone[] = {RomParameter::kGains};
constexpr RomParameter kOffsetAlone[] = {RomParameter::kEncoderOffset};

/// Gain as 0x30 shows it: at most 255, although 0xC1 may write more.
std::uint8_t as_byte(std::uint16_t gain) {
  return static_cast<std::uint8_t>(std::min<std::uint16_t>(gain, 255));
}

/// Sets the gains of 0x31 and 0x32, all but Kd. Writing the values of 0x30 changes nothing.
void set_gains(model::GainBytes& gains, const protocol::PidGains& bytes) {
  const auto set = [](std::uint16_t& gain, std::uint8_t byte) {
    if (byte != as_byte(gain)) gain = byte;
  };
  set(gains.angle_kp, bytes.angle_kp);
  set(gains.angle_ki, bytes.angle_ki);
  set(gains.speed_kp, bytes.speed_kp);
  set(gains.speed_ki, bytes.speed_ki);
  set(gains.current_kp, bytes.iq_kp);
  set(gains.current_ki, bytes.iq_ki);
}

}  // namespace

// --- registers ---

Reply Servo::on(const protocol::ReadPid&, const Context&) const {
  const auto& gains = ram_.gains;
  return protocol::Pid{{as_byte(gains.angle_kp), as_byte(gains.angle_ki), as_byte(gains.speed_kp),
                        as_byte(gains.speed_ki), as_byte(gains.current_kp),
                        as_byte(gains.current_ki)}};
}

Reply Servo::on(const protocol::WritePidToRam& command, const Context& context) {
  set_gains(ram_.gains, command.gains);
  configure(context.lane);
  return echo(context);
}

Reply Servo::on(const protocol::WritePidToRom& command, const Context& context) {
  on(protocol::WritePidToRam{command.gains}, context);
  Registers wanted = rom_;
  set_gains(wanted.gains, command.gains);
  write_rom(kGainsAlone, wanted);
  return echo(context);
}

Reply Servo::on(const protocol::ReadAcceleration&, const Context&) const {
  return protocol::Acceleration{ram_.acceleration_dps_s};
}

Reply Servo::on(const protocol::WriteAccelerationToRam& command, const Context& context) {
  ram_.acceleration_dps_s = std::max(command.acceleration_dps_s, 0);
  configure(context.lane);
  return echo(context);
}

Reply Servo::on(const protocol::WriteOffsetToRom& command, const Context& context) {
  Registers wanted = rom_;
  wanted.encoder_offset = std::min(command.offset_counts, angles_.max_wire_count());
  write_rom(kOffsetAlone, wanted);
  if (config_.quirks.offset_write_takes_effect) {
    ram_.encoder_offset = wanted.encoder_offset;
    angles_.set_offset(ram_.encoder_offset);
    motion_.single_turn.reset();  // the target is now another position
  }
  return echo(context);
}

/// Takes effect at the next power-up.
Reply Servo::on(const protocol::WriteZeroToRom&, const Context& context) {
  Registers wanted = rom_;
  wanted.encoder_offset = angles_.raw(angles_.position(context.before));
  write_rom(kOffsetAlone, wanted);
  if (!format_.dialect.zero_answered && format_.dialect.framing == protocol::Framing::kSerial) {
    return protocol::NoReply{};
  }
  return protocol::ZeroWritten{wanted.encoder_offset};
}

void Servo::write_setting(RomParameter parameter, const Registers& value, const Lane& lane) {
  Registers wanted = rom_;
  copy_parameter(parameter, value, wanted);
  write_rom({&parameter, 1}, wanted);
  copy_parameter(parameter, value, ram_);
  bus_address_ = drive_address(ram_, config_);
  pending_parameters_.reset(static_cast<std::size_t>(parameter));
  if (parameter == RomParameter::kEncoderOffset) {
    angles_.set_offset(ram_.encoder_offset);
    motion_.single_turn.reset();  // the target is now another position
  }
  configure(lane);
  reapply_limits(lane);
}

/// Worn cells keep their contents. Only 0x44 reports this; other commands do not check.
bool Servo::write_rom(std::span<const RomParameter> parameters, const Registers& rom) {
  rom_before_ = rom_;
  wear_before_ = wear_;
  ++stats_.rom_writes;
  if (faults_.rom_write_fails || faults_.rom_worn) {
    shown_faults_.rom_write_fails |= faults_.rom_write_fails;
    shown_faults_.rom_worn |= faults_.rom_worn;
    return false;
  }
  bool all = true;
  for (const RomParameter parameter : parameters) {
    saved_.reset(static_cast<std::size_t>(parameter));
    std::uint32_t& writes = wear_[static_cast<std::size_t>(parameter)];
    const bool worn = writes >= config_.flash.endurance;
    all = all && !worn;
    if (worn) continue;
    ++writes;
    copy_parameter(parameter, rom, rom_);
  }
  return all;
}

Reply Servo::on(const protocol::ReadParameter& command, const Context&) const {
  return protocol::ParameterValue{get_parameter(ram_, command.id, format_)};
}

Reply Servo::on(const protocol::WriteParameter& command, const Context& context) {
  set_parameter(ram_, command.parameter, format_);
  configure(context.lane);
  if (command.parameter.id == protocol::ParameterId::kMaxSpeed ||
      command.parameter.id == protocol::ParameterId::kMaxAngle) {
    reapply_limits(context.lane);
  }
  const bool serial = format_.dialect.framing == protocol::Framing::kSerial;
  if (serial || format_.dialect.parameter_ranges) {  // it shows the value in force
    return protocol::ParameterValue{get_parameter(ram_, command.parameter.id, format_),
                                    protocol::WriteParameter::kOpcode};
  }
  return echo(context);
}

// --- angles ---

Reply Servo::on(const protocol::ReadEncoder& command, const Context& context) const {
  const std::int64_t position = angles_.position(context.before);
  return protocol::Encoder{
      .encoder_counts = angles_.encoder(position, ram_.encoder_offset),
      .raw_counts = angles_.raw(position),
      .offset_counts = ram_.encoder_offset,
      .type = command.type,
      .full_counts = angles_.in_full(position, command.type == protocol::kEncoderZeroed)};
}

Reply Servo::on(const protocol::ReadMultiTurnAngle&, const Context& context) const {
  return protocol::MultiTurnAngle{angles_.multi_turn_cdeg(angles_.position(context.before))};
}

Reply Servo::on(const protocol::ReadSingleTurnAngle&, const Context& context) const {
  return protocol::SingleTurnAngle{angles_.single_turn_cdeg(angles_.position(context.before))};
}

Reply Servo::on(const protocol::ClearAngle& command, const Context& context) {
  const std::int64_t position = angles_.position(context.before);
  switch (format_.dialect.clear_angle) {
    case protocol::ClearAngleMeaning::kIgnored:
      break;
    case protocol::ClearAngleMeaning::kImplemented:
      angles_.clear(position);
      if (motion_.position) {
        motion_ = {};
        if (run_state_ == RunState::kRunning) {
          context.lane.command(motion_.setpoint);
        }
      }
      break;
    case protocol::ClearAngleMeaning::kSetsAngle:
      // A position command in force keeps its position on the shaft; only the angle of that
      // position changes. So the shaft does not move.
      angles_.set_multi_turn(position, zero_ram_angle(command, context));
      motion_.multi_turn_cdeg.reset();
      break;
    case protocol::ClearAngleMeaning::kZero:
      angles_.set_multi_turn(position, 0);
      motion_.multi_turn_cdeg.reset();
      break;
  }
  if (format_.dialect.zero_stops) on(protocol::Stop{}, context);
  return echo(context);
}

}  // namespace lk::emulator
