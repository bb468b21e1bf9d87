#include "emulator/config_drive.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "emulator/config_ids.hpp"
#include "emulator/config_quirks.hpp"
#include "emulator/profile.hpp"
#include "emulator/servo.hpp"
#include "emulator/shaft_angles.hpp"
#include "emulator/units.hpp"

namespace lk::emulator {
namespace {

Profile read_motor(TableReader& reader, const Overrides& overrides, const FindProfile& find) {
  const std::string in_file = reader.text("motor").value_or(kDefaultMotor);
  try {
    return find(overrides.motor.value_or(in_file));
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
  const int wire_bits = std::min(servo.profile.drive.encoder.bits, 16);
  if (servo.rom.encoder_offset >= (1 << wire_bits)) {
    settings->fail("encoder_offset", "does not fit the encoder of this motor (" +
                                         std::to_string(wire_bits) + " bit on the wire)");
  }
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

/// A brake holds until a command releases it.
void check_brake(TableReader& reader, const ServoConfig& servo) {
  if (servo.profile.drive.brake.tau == 0 || servo.quirks.dialect.brake_command) return;
  const std::string reason =
      "nothing could release it: the drive has no brake command (generation v236 has, or "
      "quirks.brake_command)";
  if (reader.has("profile")) {
    auto profile = reader.table("profile");
    if (profile->has("brake")) profile->fail("brake", reason);
  }
  reader.fail("motor", "has a brake, and " + reason);
}

/// The shaft has to start between its end stops, wherever the draw puts it.
void check_end_stops(TableReader& reader, const ServoConfig& servo) {
  const model::DriveParams& drive = servo.profile.drive;
  const auto start_deg = [&](double boot_deg) {
    return start_theta_m(servo, boot_deg) / drive.mechanics.gear_ratio / kRadPerDeg;
  };
  const double drawn_deg = 360 * encoder_turns(servo.profile, servo.quirks);
  const double first = start_deg(servo.boot_angle_deg.value_or(0));
  const double last = start_deg(servo.boot_angle_deg.value_or(drawn_deg));
  const bool below = first < drive.load.theta_min / kRadPerDeg;
  if (!below && last <= drive.load.theta_max / kRadPerDeg) return;
  auto load = reader.table("load");
  const char* stop = below ? "theta_min_deg" : "theta_max_deg";
  if (!servo.boot_angle_deg) {
    load->fail(stop, "the drawn start may lie beyond this end stop: give boot_angle_deg");
  }
  char start[32];
  std::snprintf(start, sizeof start, "%.4g", first);
  load->fail(stop, std::string("the shaft starts beyond this end stop, at ") + start + " deg");
}

}  // namespace

ServoConfig make_servo(int id, const Profile& profile) {
  ServoConfig servo;
  servo.id = id;
  servo.profile = profile;
  servo.rom = profile.factory;
  return servo;
}

std::vector<ServoConfig> read_drive(TableReader& reader, const Overrides& overrides,
                                    const FindProfile& find) {
  const std::vector<int> ids = read_ids(reader);
  if (ids.empty()) reader.note_missing("id");
  ServoConfig servo = make_servo(1, read_motor(reader, overrides, find));
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
  read_generation(reader, servo);
  read_settings(reader, servo);
  read_rom(reader, servo.flash);
  read_load(reader, servo.profile.drive.load);
  reader.finish();
  check_brake(reader, servo);
  check_end_stops(reader, servo);

  std::vector<ServoConfig> servos;
  for (const int id : ids) {
    servo.id = id;
    servos.push_back(servo);
  }
  return servos;
}

}  // namespace lk::emulator
