/// @file Functions of a servo on RS-485 only: settings, the vendor's tool, and 0x95
/// (docs/reference/rs485.md).

#include <algorithm>

#include "emulator/core/servo/registers.hpp"
#include "emulator/core/servo/servo.hpp"
#include "emulator/core/servo/tool_blocks.hpp"
#include "protocol/rounding.hpp"
#include "protocol/wire.hpp"

namespace lk::emulator {

using protocol::Block;
using protocol::ParameterId;
using protocol::Reply;
using protocol::SettingId;

namespace {

/// Returns the 0xC0 parameter of a setting; nullopt for the halves of Max Angle, or if unknown.
std::optional<ParameterId> parameter_of(SettingId id) {
  switch (id) {
    case SettingId::kAngleGains:
      return ParameterId::kAngleGains;
    case SettingId::kSpeedGains:
      return ParameterId::kSpeedGains;
    case SettingId::kCurrentGains:
      return ParameterId::kCurrentGains;
    case SettingId::kMaxTorqueCurrent:
      return ParameterId::kMaxTorqueCurrent;
    case SettingId::kMaxSpeed:
      return ParameterId::kMaxSpeed;
    case SettingId::kCurrentRamp:
      return ParameterId::kCurrentRamp;
    case SettingId::kSpeedRamp:
      return ParameterId::kSpeedRamp;
    case SettingId::kMaxAngleLow:
    case SettingId::kMaxAngleHigh:
      return std::nullopt;
  }
  return std::nullopt;
}

std::int64_t max_angle_cdeg(const Registers& registers) {
  return protocol::rounded(registers.max_angle_deg * 100);
}

protocol::Setting get_setting(const Registers& registers, SettingId id,
                              const protocol::WireFormat& format) {
  protocol::Setting setting{.id = id, .gains = {}, .number = 0};
  if (const auto parameter = parameter_of(id)) {
    const protocol::Parameter value = get_parameter(registers, *parameter, format);
    setting.gains = value.gains;
    setting.number = id == SettingId::kCurrentRamp ? in_16_bits(value.number) : value.number;
  } else {
    const std::int64_t angle_cdeg = max_angle_cdeg(registers);
    setting.number =
        static_cast<std::int32_t>(id == SettingId::kMaxAngleHigh ? angle_cdeg >> 32 : angle_cdeg);
  }
  return setting;
}

/// Returns false if the setting is unknown.
bool set_setting(Registers& registers, const protocol::Setting& setting,
                 const protocol::WireFormat& format) {
  const auto parameter = parameter_of(setting.id);
  const bool known =
      parameter || setting.id == SettingId::kMaxAngleLow || setting.id == SettingId::kMaxAngleHigh;
  if (!known || setting == get_setting(registers, setting.id, format)) return known;
  if (parameter) {
    set_parameter(registers, {*parameter, setting.gains, setting.number}, format);
    return true;
  }
  const std::int64_t old_cdeg = max_angle_cdeg(registers);
  const bool high = setting.id == SettingId::kMaxAngleHigh;
  const std::int64_t low_half =
      high ? old_cdeg & 0xFFFF'FFFF : std::int64_t{static_cast<std::uint32_t>(setting.number)};
  const std::int64_t high_half = high ? setting.number : old_cdeg >> 32;
  const std::int64_t angle_cdeg = high_half * (std::int64_t{1} << 32) + low_half;
  registers.max_angle_deg = std::clamp(0.01 * static_cast<double>(angle_cdeg), 0.0, kMaxAngle_deg);
  return true;
}

/// Returns the ROM parameter that stores the setting.
RomParameter rom_place(SettingId id, Series series) {
  const auto parameter = parameter_of(id);
  return parameter ? rom_parameter_of(*parameter, series) : RomParameter::kMaxAngle;
}

/// Returns a reply without data.
Block done(protocol::Opcode command) { return {.command = command, .data = {}, .size = 0}; }

}  // namespace

// --- settings ---

Reply Servo::on(const protocol::ReadSetting& command, const Context&) const {
  return protocol::SettingValue{get_setting(ram_, command.id, format_)};
}

Reply Servo::on(const protocol::WriteSettingToRam& command, const Context& context) {
  const bool known = set_setting(ram_, command.setting, format_);
  if (known) take_over_ram(context.lane);
  return protocol::SettingWritten{.command = protocol::WriteSettingToRam::kOpcode,
                                  .id = static_cast<std::uint8_t>(command.setting.id),
                                  .refused = !known};
}

Reply Servo::on(const protocol::WriteSettingToRom& command, const Context& context) {
  const bool known = set_setting(ram_, command.setting, format_);
  if (known) {
    take_over_ram(context.lane);
    Registers wanted = rom_;
    const RomParameter place = rom_place(command.setting.id, format_.series);
    set_setting(wanted, command.setting, format_);
    write_rom({&place, 1}, wanted);
  }
  return protocol::SettingWritten{.command = protocol::WriteSettingToRom::kOpcode,
                                  .id = static_cast<std::uint8_t>(command.setting.id),
                                  .refused = !known};
}

void Servo::take_over_ram(const Lane& lane) {
  configure(lane);
  reapply_limits(lane);
}

// --- angles ---

Reply Servo::on(const protocol::ClearTurns&, const Context& context) {
  angles_.forget_turns(angles_.position(context.before));
  motion_.multi_turn_cdeg.reset();  // the angle is now another position
  return echo(context);
}

void Servo::keep_received(const protocol::Frame& packet) {
  constexpr std::uint8_t kSevenBytes = 1 + 7;
  if (packet.dlc < kSevenBytes) return;
  left_in_buffer_cdeg_ = protocol::get_le<std::int32_t>(packet.data, 4);
}

std::int64_t Servo::zero_ram_angle(const protocol::ClearAngle& command,
                                   const Context& context) const {
  const bool takes_what_is_left = format_.dialect.framing == protocol::Framing::kSerial &&
                                  format_.dialect.zero_ram_len > 0 && context.query.size == 1;
  return takes_what_is_left ? left_in_buffer_cdeg_ : command.angle_cdeg;
}

// --- the tool ---

Reply Servo::on(const protocol::Restore&, const Context&) const {
  return done(protocol::Restore::kOpcode);
}
Reply Servo::on(const protocol::Connect&, const Context&) const {
  return done(protocol::Connect::kOpcode);
}
Reply Servo::on(const protocol::Disconnect&, const Context&) const {
  return done(protocol::Disconnect::kOpcode);
}
Reply Servo::on(const protocol::ReadProduct&, const Context&) const {
  return product_block(config_);
}
Reply Servo::on(const protocol::ReadDeviceType&, const Context&) const {
  return protocol::DeviceType{device_type(format_.series)};
}
Reply Servo::on(const protocol::ReadSettingsBlock&, const Context&) const {
  return settings_block(config_, ram_, format_);
}
Reply Servo::on(const protocol::WriteSettingsBlock&, const Context& context) {
  take_settings_block(context.query.data, format_, ram_);
  take_over_ram(context.lane);
  return done(protocol::WriteSettingsBlock::kOpcode);
}
Reply Servo::on(const protocol::ReadCalibration&, const Context&) const {
  return calibration_block(config_, ram_);
}
Reply Servo::on(const protocol::WriteCalibration&, const Context&) const {
  return done(protocol::WriteCalibration::kOpcode);
}
Reply Servo::on(const protocol::AlignReducer&, const Context&) const {
  Block block = calibration_block(config_, ram_);
  block.command = protocol::AlignReducer::kOpcode;
  return block;
}
Reply Servo::on(const protocol::RestoreSettings&, const Context& context) {
  ram_ = config_.profile.factory;
  take_over_ram(context.lane);
  return done(protocol::RestoreSettings::kOpcode);
}
Reply Servo::on(const protocol::RestoreCalibration&, const Context&) const {
  return done(protocol::RestoreCalibration::kOpcode);
}

}  // namespace lk::emulator
