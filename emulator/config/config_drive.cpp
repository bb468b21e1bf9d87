#include "emulator/config/config_drive.hpp"

#include <cmath>

#include "emulator/config/config_checks.hpp"
#include "emulator/config/config_ids.hpp"
#include "emulator/config/config_quirks.hpp"
#include "emulator/config/profile.hpp"

namespace lk::emulator {
namespace {

Profile read_motor(TableReader& reader, const Overrides& overrides, const FindProfile& find) {
  const std::string in_file = reader.text("motor").value_or(kDefaultMotor);
  try {
    return find(overrides.motor.value_or(motor_of(reader.file(), in_file)));
  } catch (const UnknownMotor& problem) {
    if (overrides.motor) throw;
    reader.fail("motor", problem.what());
  }
}

void read_settings(TableReader& reader, ServoConfig& servo) {
  auto settings = reader.table("settings");
  if (!settings) return;
  const protocol::Dialect& dialect = servo.quirks.dialect;
  read_registers(*settings, Presence::kOptional,
                 {.series = servo.profile.series,
                  .iq_limit_lsb = dialect.iq_command_limit_lsb,
                  .wide_gains = dialect.parameter_commands},
                 servo.rom);
  settings->finish();
}

void read_rom(TableReader& reader, RomParams& flash) {
  auto rom = reader.table("rom");
  if (!rom) return;
  if (const auto ms = rom->number("write_time_ms", 0, 10'000)) {
    flash.write_time = SimTime(std::llround(*ms * 1e6));
  }
  if (const auto writes = rom->integer("endurance_writes", 0, UINT32_MAX)) {
    flash.endurance = static_cast<std::uint32_t>(*writes);
  }
  rom->finish();
}

ServoConfig as_delivered(const Profile& profile) {
  ServoConfig servo;
  servo.profile = profile;
  servo.rom = profile.factory;
  return servo;
}

}  // namespace

ServoConfig make_servo(int id, const Profile& profile, const FirmwareRequest& asked) {
  ServoConfig servo = as_delivered(profile);
  servo.id = id;
  const toml::table nothing;
  TableReader reader(nothing, "", "");
  read_generation(reader, asked, servo);
  return servo;
}

std::vector<ServoConfig> read_drive(TableReader& reader, const Overrides& overrides,
                                    const FirmwareRequest& asked, const FindProfile& find) {
  const std::vector<int> ids = read_ids(reader);
  if (ids.empty()) reader.note_missing("id");
  ServoConfig servo = as_delivered(read_motor(reader, overrides, find));
  if (auto changes = reader.table("profile")) {
    read_drive_params(*changes, Presence::kOptional, servo.profile.drive);
    changes->finish();
  }
  if (const auto us = reader.integer("reply_time_us", 0, 100'000)) {
    servo.reply_time = std::chrono::microseconds(*us);
  }
  // A turn of the output to either side.
  const double turn_deg = 360 * servo.profile.drive.mechanics.gear_ratio;
  servo.boot_angle_deg = reader.number("boot_angle_deg", -turn_deg, turn_deg);
  read_generation(reader, asked, servo);
  read_settings(reader, servo);
  read_rom(reader, servo.flash);
  read_load(reader, servo.profile.drive.load);
  reader.finish();
  check_drive(reader, servo);

  std::vector<ServoConfig> servos;
  for (const int id : ids) {
    servo.id = id;
    servos.push_back(servo);
  }
  return servos;
}

}  // namespace lk::emulator
