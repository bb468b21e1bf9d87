/// @file Registers in RAM and ROM, and changes of the drive's address.

#include <algorithm>
#include <utility>
#include <vector>

#include "emulator/core/servo/servo_commands.hpp"
#include "protocol/field_values.hpp"

namespace lk::emulator {

using protocol::ParameterId;
using protocol::Reply;

namespace {

constexpr RomParameter kGainsAlone[] = {RomParameter::kGains};

/// Returns a gain as the reply to 0x30 shows it: at most 255, although 0xC1 may write more.
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

/// Returns true if each number of a query is within the range in the command table.
bool is_within_ranges(const Query& query, const protocol::WireFormat& format) {
  const auto& info = protocol::info_of(query.command, format.dialect.framing);
  return std::ranges::all_of(info.query, [&](const protocol::Field& field) {
    if (!protocol::present(field, query.data, format)) return true;
    const std::int64_t number = protocol::raw(field, query.data);
    if (!field.values.empty()) {
      return std::ranges::find(field.values, static_cast<unsigned>(number),
                               &protocol::Value::number) != field.values.end();
    }
    const protocol::RawRange range = protocol::raw_range(field, format);
    return number >= range.min && number <= range.max;
  });
}

/// Returns the setting with the value that 0x40 returns.
protocol::StoredSetting shown_setting(const Servo& servo, const protocol::StoredSetting& which) {
  const bool shows_pending = servo.config.quirks.setting_read == SettingRead::kPending;
  return get_stored(shows_pending ? pending_rom(servo) : servo.ram, which, servo.config,
                    servo.format);
}

/// Requests that the address in pending_rom() takes effect after the reply to the present query.
void schedule_address_change(Servo& servo) {
  servo.address_change_pending = true;
  // For kOld the reply has the old ID: the bus encodes it before it calls take_address_change().
  if (servo.config.quirks.id_change_reply == IdChangeReply::kNew) {
    servo.bus_address = drive_address(pending_rom(servo), servo.config);
  }
}

}  // namespace

void configure_loops(const Servo& servo, const Lane& lane) {
  lane.configure(control_settings(servo.ram, servo.format));
}

void apply_ram(Servo& servo, const Lane& lane) {
  configure_loops(servo, lane);
  reapply_limits(servo, lane);
}

/// Worn cells keep their contents. Only 0x44 reports this; other commands do not check.
bool write_rom(Servo& servo, std::span<const RomParameter> parameters, const Registers& rom) {
  servo.rom_before = servo.rom;
  servo.wear_before = servo.wear;
  ++servo.stats.rom_writes;
  if (servo.faults.rom_write_fails || servo.faults.rom_worn) {
    servo.effective_faults.rom_write_fails |= servo.faults.rom_write_fails;
    servo.effective_faults.rom_worn |= servo.faults.rom_worn;
    return false;
  }
  bool all = true;
  for (const RomParameter parameter : parameters) {
    servo.saved_parameters.reset(static_cast<std::size_t>(parameter));
    std::uint32_t& writes = servo.wear[static_cast<std::size_t>(parameter)];
    const bool worn = writes >= servo.config.flash.endurance;
    all = all && !worn;
    if (worn) continue;
    ++writes;
    copy_parameter(parameter, rom, servo.rom);
  }
  return all;
}

void write_setting(Servo& servo, RomParameter parameter, const Registers& value, const Lane& lane) {
  Registers wanted = servo.rom;
  copy_parameter(parameter, value, wanted);
  write_rom(servo, {&parameter, 1}, wanted);
  copy_parameter(parameter, value, servo.ram);
  servo.bus_address = drive_address(servo.ram, servo.config);
  servo.pending_parameters.reset(static_cast<std::size_t>(parameter));
  if (parameter == RomParameter::kEncoderOffset) {
    apply_offset(servo);
  }
  apply_ram(servo, lane);
}

Reply execute(const Servo& servo, const protocol::ReadPid&, const Context&) {
  const auto& gains = servo.ram.gains;
  return protocol::Pid{{as_byte(gains.angle_kp), as_byte(gains.angle_ki), as_byte(gains.speed_kp),
                        as_byte(gains.speed_ki), as_byte(gains.current_kp),
                        as_byte(gains.current_ki)}};
}

Reply execute(Servo& servo, const protocol::WritePidToRam& command, const Context& context) {
  set_gains(servo.ram.gains, command.gains);
  configure_loops(servo, context.lane);
  return echo(context);
}

Reply execute(Servo& servo, const protocol::WritePidToRom& command, const Context& context) {
  execute(servo, protocol::WritePidToRam{command.gains}, context);
  Registers wanted = servo.rom;
  set_gains(wanted.gains, command.gains);
  write_rom(servo, kGainsAlone, wanted);
  return echo(context);
}

Reply execute(const Servo& servo, const protocol::ReadAcceleration&, const Context&) {
  return protocol::Acceleration{servo.ram.acceleration_dps_s};
}

Reply execute(Servo& servo, const protocol::WriteAccelerationToRam& command,
              const Context& context) {
  servo.ram.acceleration_dps_s = std::max(command.acceleration_dps_s, 0);
  configure_loops(servo, context.lane);
  return echo(context);
}

Reply execute(const Servo& servo, const protocol::ReadParameter& command, const Context&) {
  return protocol::ParameterValue{get_parameter(servo.ram, command.id, servo.format)};
}

Reply execute(Servo& servo, const protocol::WriteParameter& command, const Context& context) {
  set_parameter(servo.ram, command.parameter, servo.format);
  configure_loops(servo, context.lane);
  if (command.parameter.id == protocol::ParameterId::kMaxSpeed ||
      command.parameter.id == protocol::ParameterId::kMaxAngle) {
    reapply_limits(servo, context.lane);
  }
  const bool serial = servo.format.dialect.framing == protocol::Framing::kSerial;
  if (serial || servo.format.dialect.parameter_ranges) {  // the reply shows the value in force
    return protocol::ParameterValue{get_parameter(servo.ram, command.parameter.id, servo.format),
                                    protocol::WriteParameter::kOpcode};
  }
  return echo(context);
}

// Commands for Max Torque Current, on older drives.

Reply execute(const Servo& servo, const protocol::ReadMaxTorque&, const Context&) {
  return protocol::MaxTorque{
      get_parameter(servo.ram, ParameterId::kMaxTorqueCurrent, servo.format).number};
}

Reply execute(Servo& servo, const protocol::WriteMaxTorque& command, const Context& context) {
  const std::int32_t now =
      get_parameter(servo.ram, ParameterId::kMaxTorqueCurrent, servo.format).number;
  const std::int32_t most = std::max(protocol::kMaxTorque_lsb, now);
  set_parameter(servo.ram,
                {ParameterId::kMaxTorqueCurrent, {}, std::min(command.max_torque_lsb, most)},
                servo.format);
  configure_loops(servo, context.lane);
  return echo(context);
}

// Commands 0x40, 0x42 and 0x44 of the V2.36 manual's second print (docs/reference/protocol.md
// §10.9).

Registers pending_rom(const Servo& servo) {
  Registers all = servo.rom;
  for (std::size_t p = 0; p < kRomParameters; ++p) {
    if (servo.pending_parameters[p])
      copy_parameter(static_cast<RomParameter>(p), servo.pending, all);
  }
  return all;
}

Reply execute(const Servo& servo, const protocol::ReadStoredSetting& command, const Context&) {
  return protocol::StoredSettingValue{shown_setting(servo, command.setting)};
}

Reply execute(Servo& servo, const protocol::WriteStoredSetting& command, const Context& context) {
  const bool as_read = command.setting == shown_setting(servo, command.setting);
  if (as_read || is_within_ranges(context.query, servo.format)) {
    servo.pending = pending_rom(servo);
    set_stored(servo.pending, command.setting, servo.config, servo.format);
    servo.pending_parameters.set(
        static_cast<std::size_t>(rom_parameter_of(command.setting.id(), servo.format.series)));
    if (servo.config.quirks.id_change == IdChange::kWrite) schedule_address_change(servo);
  }
  return protocol::StoredSettingValue{
      get_stored(pending_rom(servo), command.setting, servo.config, servo.format),
      protocol::WriteStoredSetting::kOpcode};
}

Reply execute(Servo& servo, const protocol::SaveSettings& command, const Context&) {
  if (servo.pending_parameters.none()) return protocol::SettingsSaved{command.table, true};
  std::vector<RomParameter> written;
  for (std::size_t p = 0; p < kRomParameters; ++p) {
    if (servo.pending_parameters[p]) written.push_back(static_cast<RomParameter>(p));
  }
  const bool saved = write_rom(servo, written, pending_rom(servo));
  if (saved) {
    servo.saved_parameters = std::exchange(servo.pending_parameters, {});
    if (servo.config.quirks.id_change == IdChange::kSave) schedule_address_change(servo);
  }
  return protocol::SettingsSaved{command.table, saved};
}

void restore_rom(Servo& servo, const Registers& rom, const RomWear& wear) {
  servo.rom = rom;
  servo.wear = wear;
  // Settings that 0x44 saved, but that could not be stored, become pending again.
  for (std::size_t p = 0; p < kRomParameters; ++p) {
    Registers with = rom;
    copy_parameter(static_cast<RomParameter>(p), servo.pending, with);
    if (servo.saved_parameters[p] && with != rom) servo.pending_parameters.set(p);
  }
  servo.saved_parameters.reset();
}

bool take_address_change(Servo& servo) {
  if (!std::exchange(servo.address_change_pending, false)) return false;
  const Registers next = pending_rom(servo);
  for (const auto parameter : {RomParameter::kDriverId, RomParameter::kBusType,
                               RomParameter::kSerialRate, RomParameter::kCanRate}) {
    copy_parameter(parameter, next, servo.ram);
  }
  servo.bus_address = drive_address(servo.ram, servo.config);
  return true;
}

void change_id(Servo& servo, int id) {
  servo.rom.driver_id = static_cast<std::uint8_t>(id);
  ++servo.wear[static_cast<std::size_t>(RomParameter::kDriverId)];
  ++servo.stats.rom_writes;
  servo.ram.driver_id = servo.rom.driver_id;
  servo.bus_address = drive_address(servo.ram, servo.config);
}

}  // namespace lk::emulator
