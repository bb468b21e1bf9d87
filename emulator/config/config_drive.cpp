#include "emulator/config/config_drive.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "emulator/config/config_body.hpp"
#include "emulator/config/config_checks.hpp"
#include "emulator/config/config_quirks.hpp"
#include "emulator/config/config_serial.hpp"
#include "emulator/config/profile.hpp"
#include "emulator/core/text.hpp"
#include "protocol/rounding.hpp"

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
    flash.write_time = SimTime(protocol::rounded(*ms * 1e6));
  }
  if (const auto writes = rom->integer("endurance_writes", 0, UINT32_MAX)) {
    flash.endurance = static_cast<std::uint32_t>(*writes);
  }
  rom->finish();
}

ServoConfig as_delivered(const Profile& profile, const BusOptions& bus_options) {
  ServoConfig servo;
  servo.profile = profile;
  servo.rom = profile.factory;
  servo.specimen = profile.states_cogging ? Specimen::kNominal : Specimen::kDrawn;
  if (bus_options.serial != nullptr) {
    servo.quirks.dialect.framing = protocol::Framing::kSerial;
    servo.reply_time = bus_options.serial->reply_time;
    servo.reply_spread = bus_options.serial->reply_spread;
    servo.rate_code = rate_code(bus_options.bitrate, bus_options.serial->has_921600);
  } else {
    servo.rate_code = can_rate_code(bus_options.bitrate);
  }
  return servo;
}

/// Checks the bit rate for multi-drive mode on RS-485.
void check_broadcast(TableReader& reader, const ServoConfig& servo, const BusOptions& bus_options) {
  constexpr std::int64_t kSlowest = 1'000'000;
  if (bus_options.serial == nullptr || !servo.rom.broadcast_mode) return;
  if (bus_options.bitrate == 0 || bus_options.bitrate >= kSlowest) return;
  auto settings = reader.table("settings");
  const std::string problem = "needs 1, 2 or 4 Mbit/s on RS-485, and this bus has " +
                              std::to_string(bus_options.bitrate) + " bit/s";
  if (settings && settings->has("broadcast_mode")) settings->fail("broadcast_mode", problem);
  reader.fail("motor", "is in broadcast mode, which " + problem);
}

std::string name_of(const BusOptions& bus_options, int id) {
  return bus_options.interface + " drive " + std::to_string(id);
}

/// Returns the first of `ids` that runs.
std::optional<int> first_running(const std::vector<int>& ids, const BusOptions& bus_options) {
  const auto runs = [&](int id) {
    return !bus_options.ids || std::ranges::find(*bus_options.ids, id) != bus_options.ids->end();
  };
  const auto found = std::ranges::find_if(ids, runs);
  return found == ids.end() ? std::nullopt : std::optional(*found);
}

/// Returns the command-line options for these drives as text: " --generation v235".
std::string options_of(const BusOptions& bus_options) {
  std::string all;
  if (bus_options.firmware.generation) all += " --generation " + *bus_options.firmware.generation;
  for (const auto& [key, value] : bus_options.firmware.quirks)
    all += " --quirk " + key + "=" + value;
  if (bus_options.boot_angle_deg)
    all += " --boot-angle " + plain_number(*bus_options.boot_angle_deg);
  return all;
}

/// Returns the largest boot angle of either sign, in degrees of the rotor: one turn of the output.
double most_boot_angle_deg(const ServoConfig& servo) {
  return 360 * servo.profile.drive.mechanics.gear_ratio;
}

/// Sets the boot angle to that of the command line, if given. Throws std::invalid_argument.
void apply_boot_angle(std::optional<double> asked_deg, const std::string& drive,
                      ServoConfig& servo) {
  if (!asked_deg) return;
  const double most_deg = most_boot_angle_deg(servo);
  if (servo.joint) {
    throw std::invalid_argument("--boot-angle: " + drive +
                                " has a joint: the body sets its start angle");
  }
  if (!(std::abs(*asked_deg) <= most_deg)) {
    throw std::invalid_argument("--boot-angle: " + plain_number(*asked_deg) + " is out of range (" +
                                plain_number(-most_deg) + " to " + plain_number(most_deg) +
                                ", a turn of the output) of " + drive);
  }
  servo.boot_angle_deg = asked_deg;
}

/// Returns true if [profile] states the cogging or the offsets of one motor.
bool states_texture(TableReader& changes) {
  const auto mechanics = changes.table("mechanics");
  const auto sensor = changes.table("current_sensor");
  return (mechanics && mechanics->has("tau_cogging_mNm")) ||
         (sensor && (sensor->has("offset_a_A") || sensor->has("offset_b_A")));
}

/// Reads a drive; `bus_options` are those of the command line.
std::vector<ServoConfig> read_with(TableReader& reader, const Overrides& overrides,
                                   const BusOptions& bus_options, const FindProfile& find) {
  const std::vector<int> ids = read_ids(reader);
  if (ids.empty()) reader.note_missing("id");
  ServoConfig servo = as_delivered(read_motor(reader, overrides, find), bus_options);
  // Drives that do not run may not support the requests of the command line: ignores the requests.
  const auto running = first_running(ids, bus_options);
  read_generation(reader, running ? bus_options.firmware : FirmwareRequest{},
                  name_of(bus_options, running.value_or(0)), servo);
  if (auto changes = reader.table("profile")) {
    read_drive_params(*changes, Presence::kOptional, servo.profile.drive);
    if (states_texture(*changes)) servo.specimen = Specimen::kNominal;
    changes->finish();
  }
  apply_encoder_bits(servo);
  if (const auto us = reader.integer("reply_time_us", 0, 100'000)) {
    servo.reply_time = std::chrono::microseconds(*us);
    servo.reply_spread = SimTime{0};
  }
  if (const auto id = reader.integer("dip_id", protocol::kMinId, protocol::kMaxId)) {
    servo.dip_id = static_cast<int>(*id);
  }
  if (const auto s = reader.number("calibrate_s", 0.1, 600)) {
    servo.calibrate_time = SimTime(protocol::rounded(*s * 1e9));
  }
  const double most_deg = most_boot_angle_deg(servo);
  servo.boot_angle_deg = reader.number("boot_angle_deg", -most_deg, most_deg);
  servo.boot_temperature_C = reader.number("boot_temperature_C", -40, 125);
  if (const auto specimen = reader.choice("specimen", {"nominal", "drawn"})) {
    servo.specimen = static_cast<Specimen>(*specimen);
  }
  read_settings(reader, servo);
  read_rom(reader, servo.flash);
  servo.joint = read_joint(reader, servo, bus_options.body);
  if (running) apply_boot_angle(bus_options.boot_angle_deg, name_of(bus_options, *running), servo);
  read_load(reader, servo.profile.drive.load);
  reader.finish();
  check_drive(reader, servo);
  check_broadcast(reader, servo, bus_options);

  std::vector<ServoConfig> servos;
  for (const int id : ids) {
    servo.id = id;
    servos.push_back(servo);
  }
  return servos;
}

/// Returns true if the drive is valid without the options that `options_of` returns.
bool is_good_as_it_stands(TableReader reader, const Overrides& overrides,
                          const BusOptions& bus_options, const FindProfile& find) {
  try {
    BusOptions nothing = bus_options;
    nothing.firmware = {};
    nothing.boot_angle_deg = std::nullopt;
    read_with(reader, overrides, nothing, find);
    return true;
  } catch (const ConfigError&) {
    return false;
  }
}

}  // namespace

ServoConfig make_servo(int id, const Profile& profile, const BusOptions& bus_options) {
  ServoConfig servo = as_delivered(profile, bus_options);
  servo.id = id;
  const toml::table nothing;
  TableReader reader(nothing, "--motor", "");
  read_generation(reader, bus_options.firmware, name_of(bus_options, id), servo);
  apply_encoder_bits(servo);
  apply_boot_angle(bus_options.boot_angle_deg, name_of(bus_options, id), servo);
  try {
    check_drive(reader, servo);
  } catch (const ConfigError& problem) {
    throw std::invalid_argument("--motor: " + sanitized_line(profile.name) + ": " + problem.reason);
  }
  return servo;
}

std::vector<ServoConfig> read_drive(TableReader& reader, const Overrides& overrides,
                                    const BusOptions& bus_options, const FindProfile& find) {
  const TableReader unread = reader;
  try {
    return read_with(reader, overrides, bus_options, find);
  } catch (const ConfigError& problem) {
    const std::string options = options_of(bus_options);
    // For a wrong --quirk the error already names the option instead of the file.
    if (options.empty() || problem.file != reader.file() ||
        !is_good_as_it_stands(unread, overrides, bus_options, find)) {
      throw;
    }
    throw ConfigError(problem.file, problem.line, problem.key,
                      problem.reason + " (with" + options + " of the command line)");
  }
}

}  // namespace lk::emulator
