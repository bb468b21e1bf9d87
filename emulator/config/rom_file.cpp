#include "emulator/config/rom_file.hpp"

#include <algorithm>
#include <cassert>
#include <charconv>
#include <iterator>
#include <optional>
#include <string_view>

#include "emulator/config/bus_name.hpp"
#include "emulator/config/config_checks.hpp"
#include "emulator/config/config_reader.hpp"
#include "emulator/config/profile.hpp"
#include "emulator/config/profile_fields.hpp"
#include "emulator/config/register_fields.hpp"

namespace lk::emulator {
namespace {

namespace fields = profile_fields;

constexpr int kFormat = 1;

/// Key of each RomParameter in [settings], [writes] and directives, indexed by RomParameter.
constexpr const char* kKeys[] = {
    "gains",
    "acceleration_dps_s",
    "encoder_offset",
    "max_torque_current_lsb",
    "max_power_permille",
    "max_speed_dps",
    "max_angle_deg",
    "current_ramp_A_s",
    "broadcast_mode",
    "protection",
    "align_value",
    "driver_id",
    "bus_type",
    "rs485_rate",
    "can_rate",
};
static_assert(std::size(kKeys) == kRomParameters);

bool is(RomParameter parameter, std::size_t index) {
  return static_cast<std::size_t>(parameter) == index;
}

/// Returns the field row of a single-value parameter.
std::span<const Field<Registers>> row_of(std::size_t parameter) {
  static constexpr Field<Registers> kMaxTorqueCurrent = fields::max_torque_current(2048);
  static constexpr Field<Registers> kMaxPower = fields::max_power();
  if (is(RomParameter::kMaxTorqueCurrent, parameter)) return {&kMaxTorqueCurrent, 1};
  if (is(RomParameter::kMaxPower, parameter)) return {&kMaxPower, 1};
  const std::string_view key = kKeys[parameter];
  using Rows = std::span<const Field<Registers>>;
  for (const Rows rows :
       {Rows(fields::kRegisters), Rows(fields::kPlace), Rows(fields::kAlignment)}) {
    const auto row = std::ranges::find(rows, key, &Field<Registers>::key);
    if (row != rows.end()) return {&*row, 1};
  }
  assert(false && "each parameter has a row");
  return {};
}

/// Returns true for an address parameter that was never written: ROM files leave it out.
bool is_as_wired(std::size_t parameter, const Registers& rom) {
  const std::string_view key = kKeys[parameter];
  const auto* row = std::ranges::find(fields::kPlace, key, &Field<Registers>::key);
  return row != std::end(fields::kPlace) &&
         rom.*std::get<std::uint8_t Registers::*>(row->member) == kAsWired;
}

// --- values to text

std::string quoted(const std::string& text) {
  std::string all = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') all += '\\';
    all += c;
  }
  return all + '"';
}

/// Returns the shortest text that parses to the same value.
template <typename Number>
std::string shortest(Number value) {
  char buffer[32];
  const auto [end, error] = std::to_chars(std::begin(buffer), std::end(buffer), value);
  assert(error == std::errc());
  return {std::begin(buffer), end};
}

template <typename Section>
std::string print_value(const Field<Section>& field, const Section& section) {
  return std::visit(
      [&](auto member) -> std::string {
        const auto value = section.*member;
        if constexpr (std::is_same_v<decltype(value), const bool>) {
          return value ? "true" : "false";
        } else if constexpr (std::is_same_v<decltype(value), const double>) {
          assert(field.unit == 1);  // otherwise the value would not round-trip exactly
          return shortest(value);
        } else {
          return std::to_string(value);
        }
      },
      field.member);
}

template <typename Section>
std::string print_line(const Field<Section>& field, const Section& section) {
  return std::string(field.key) + " = " + print_value(field, section) + '\n';
}

std::string print_gains(const model::GainBytes& gains) {
  std::string inside;
  for (const auto& field : fields::kWideGains) {
    inside += (inside.empty() ? "" : ", ") + std::string(field.key) + " = ";
    inside += print_value(field, gains);
  }
  return "gains = { " + inside + " }\n";
}

std::string print_protections(const Registers& rom) {
  std::string all;
  for (std::size_t kind = 0; kind < rom.protections.size(); ++kind) {
    const auto& keys = fields::kProtections[kind];
    all += std::string("\n[settings.protection.") + keys.name + "]\n";
    for (const auto& field : keys.fields) all += print_line(field, rom.protections[kind]);
  }
  return all;
}

// --- text to values

void check_owner(const TableReader& reader, const RomOwner& found, const RomOwner& drive) {
  const auto name = [](const RomOwner& owner) {
    return owner.bus + ":" + std::to_string(owner.id) + ", motor " + owner.motor;
  };
  const auto refuse = [&](const char* key) {
    reader.fail(key, "this is the ROM of " + name(found) + ", not of " + name(drive));
  };
  if (found.bus != drive.bus) refuse("bus");
  if (found.id != drive.id) refuse("id");
  if (found.motor != drive.motor) refuse("motor");
}

template <typename Value>
Value required(TableReader& reader, const char* key, const std::optional<Value>& value) {
  if (!value) reader.fail(key, "missing");
  return *value;
}

void read_header(TableReader& reader, const RomOwner& drive) {
  const auto format = required(reader, "format", reader.integer("format", 0, INT64_MAX));
  if (format != kFormat) {
    reader.fail("format", std::to_string(format) + " is not known to this version of lk-emu, " +
                              std::to_string(kFormat) + " is");
  }
  RomOwner found;
  found.bus = required(reader, "bus", reader.text("bus"));
  found.id = static_cast<int>(required(reader, "id", reader.integer("id", 1, INT32_MAX)));
  found.motor = required(reader, "motor", reader.text("motor"));
  check_owner(reader, found, drive);
}

RomWear read_writes(TableReader& reader) {
  RomWear wear{};
  auto writes = reader.table("writes");
  if (!writes) reader.fail("writes", "missing");
  for (std::size_t p = 0; p < kRomParameters; ++p) {
    if (const auto count = writes->integer(kKeys[p], 1, UINT32_MAX)) {
      wear[p] = static_cast<std::uint32_t>(*count);
    }
  }
  writes->finish();
  return wear;
}

void read_settings(TableReader& settings, const RomWear& wear, ServoConfig& servo) {
  for (std::size_t p = 0; p < kRomParameters; ++p) {
    if (wear[p] == 0) {
      if (settings.has(kKeys[p])) settings.fail(kKeys[p], "[writes] has no count of it");
    } else if (!settings.has(kKeys[p])) {
      settings.fail(kKeys[p], "missing, though [writes] counts it");
    } else if (is(RomParameter::kGains, p)) {
      read_section(settings, kKeys[p], fields::kWideGains, Presence::kRequired, servo.rom.gains);
    } else if (is(RomParameter::kProtections, p)) {
      read_protections(settings, Presence::kRequired, servo.rom);
    } else {
      read_fields<Registers>(settings, row_of(p), Presence::kRequired, servo.rom);
    }
  }
  // Checks the offset of the ROM file; that of the configuration was checked when it was read.
  const std::string problem = offset_problem(servo.rom.encoder_offset, servo.profile.drive.encoder);
  if (!problem.empty()) settings.fail("encoder_offset", problem);
  settings.finish();
}

}  // namespace

const char* rom_key(RomParameter parameter) { return kKeys[static_cast<std::size_t>(parameter)]; }

std::string print_rom(const RomOwner& owner, const Registers& rom, const RomWear& wear) {
  std::string settings = "\n[settings]\n";
  std::string tables;
  std::string writes = "\n[writes]\n";
  for (std::size_t p = 0; p < kRomParameters; ++p) {
    if (wear[p] == 0 || is_as_wired(p, rom)) continue;
    writes += std::string(kKeys[p]) + " = " + std::to_string(wear[p]) + '\n';
    if (is(RomParameter::kGains, p)) {
      settings += print_gains(rom.gains);
    } else if (is(RomParameter::kProtections, p)) {
      tables += print_protections(rom);
    } else {
      settings += print_line(row_of(p).front(), rom);
    }
  }
  return "# ROM of a virtual drive, kept by lk-emu: what was written to it, and how often.\n"
         "# All else is as configured.\n"
         "format = " +
         std::to_string(kFormat) + "\nbus = " + quoted(owner.bus) +
         "\nid = " + std::to_string(owner.id) + "\nmotor = " + quoted(owner.motor) + '\n' +
         settings + tables + writes;
}

void read_rom(const std::string& text, const std::string& file, const std::string& bus,
              ServoConfig& servo) {
  const toml::table document = parse_toml(text, file);
  // Without the last newline the file is truncated: its last number may have lost digits.
  if (!text.ends_with('\n')) {
    const auto lines = std::ranges::count(text, '\n');
    throw ConfigError(file, static_cast<int>(lines) + 1, "", "the file is cut off here");
  }
  ServoConfig with_rom = servo;
  TableReader reader(document, file, "");
  read_header(reader, {bus, servo.id, servo.profile.name});
  with_rom.wear = read_writes(reader);
  auto settings = reader.table("settings");
  if (!settings) reader.fail("settings", "missing");
  with_rom.boot_offset = servo.boot_offset.value_or(servo.rom.encoder_offset);
  read_settings(*settings, with_rom.wear, with_rom);
  reader.finish();
  servo = std::move(with_rom);
}

std::string rom_file_name(const std::string& bus, int id) {
  return bus_file_name(bus) + "-" + std::to_string(id) + ".toml";
}

}  // namespace lk::emulator
