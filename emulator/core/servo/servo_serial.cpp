/// @file Commands that exist on RS-485 only: settings, and those of the vendor's tool
/// (docs/reference/rs485.md).

#include <algorithm>

#include "emulator/core/servo/registers.hpp"
#include "emulator/core/servo/servo_commands.hpp"
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

Reply execute(const Servo& servo, const protocol::ReadSetting& command, const Context&) {
  return protocol::SettingValue{get_setting(servo.ram, command.id, servo.format)};
}

Reply execute(Servo& servo, const protocol::WriteSettingToRam& command, const Context& context) {
  const bool known = set_setting(servo.ram, command.setting, servo.format);
  if (known) apply_ram(servo, context.lane);
  return protocol::SettingWritten{.command = protocol::WriteSettingToRam::kOpcode,
                                  .id = static_cast<std::uint8_t>(command.setting.id),
                                  .refused = !known};
}

Reply execute(Servo& servo, const protocol::WriteSettingToRom& command, const Context& context) {
  const bool known = set_setting(servo.ram, command.setting, servo.format);
  if (known) {
    apply_ram(servo, context.lane);
    Registers wanted = servo.rom;
    const RomParameter place = rom_place(command.setting.id, servo.format.series);
    set_setting(wanted, command.setting, servo.format);
    write_rom(servo, {&place, 1}, wanted);
  }
  return protocol::SettingWritten{.command = protocol::WriteSettingToRom::kOpcode,
                                  .id = static_cast<std::uint8_t>(command.setting.id),
                                  .refused = !known};
}

// --- the tool ---

Reply execute(const Servo&, const protocol::Restore&, const Context&) {
  return done(protocol::Restore::kOpcode);
}
Reply execute(const Servo&, const protocol::Connect&, const Context&) {
  return done(protocol::Connect::kOpcode);
}
Reply execute(const Servo&, const protocol::Disconnect&, const Context&) {
  return done(protocol::Disconnect::kOpcode);
}
Reply execute(const Servo& servo, const protocol::ReadProduct&, const Context&) {
  return product_block(servo.config);
}
Reply execute(const Servo& servo, const protocol::ReadDeviceType&, const Context&) {
  return protocol::DeviceType{device_type(servo.format.series)};
}
Reply execute(const Servo& servo, const protocol::ReadSettingsBlock&, const Context&) {
  return settings_block(servo.config, servo.ram, servo.format);
}
Reply execute(Servo& servo, const protocol::WriteSettingsBlock&, const Context& context) {
  take_settings_block(context.query.data, servo.format, servo.ram);
  apply_ram(servo, context.lane);
  return done(protocol::WriteSettingsBlock::kOpcode);
}
Reply execute(const Servo& servo, const protocol::ReadCalibration&, const Context&) {
  return calibration_block(servo.config, servo.ram);
}
Reply execute(const Servo&, const protocol::WriteCalibration&, const Context&) {
  return done(protocol::WriteCalibration::kOpcode);
}
Reply execute(const Servo& servo, const protocol::AlignReducer&, const Context&) {
  Block block = calibration_block(servo.config, servo.ram);
  block.command = protocol::AlignReducer::kOpcode;
  return block;
}
Reply execute(Servo& servo, const protocol::RestoreSettings&, const Context& context) {
  servo.ram = servo.config.profile.factory;
  apply_ram(servo, context.lane);
  return done(protocol::RestoreSettings::kOpcode);
}
Reply execute(const Servo&, const protocol::RestoreCalibration&, const Context&) {
  return done(protocol::RestoreCalibration::kOpcode);
}

}  // namespace lk::emulator
