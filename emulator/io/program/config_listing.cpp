#include "emulator/io/program/config_listing.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>

#include "emulator/config/config_quirks.hpp"
#include "emulator/config/config_serial.hpp"
#include "emulator/config/profile_fields.hpp"
#include "emulator/config/register_fields.hpp"
#include "emulator/core/generation.hpp"
#include "emulator/core/servo/registers.hpp"
#include "emulator/core/servo/shaft_angles.hpp"
#include "emulator/core/text.hpp"
#include "emulator/core/units.hpp"
#include "emulator/io/program/loop_margins.hpp"
#include "protocol/command_info.hpp"
#include "protocol/commands.hpp"
#include "protocol/field_values.hpp"

namespace lk::emulator {
namespace {

constexpr const char* kNone = "-";

std::string number(double value) { return plain_number(value, 6); }
/// Formats a limit; 0 means no limit.
std::string limit(double value) { return value == 0 ? kNone : number(value); }

std::string bitrate_text(std::int64_t bitrate) {
  if (bitrate == 0) return "frames take no time";
  if (bitrate % 1'000'000 == 0) return fmt::format("{} Mbit/s", bitrate / 1'000'000);
  return fmt::format("{} kbit/s", number(static_cast<double>(bitrate) / 1e3));
}

/// Returns ", queue of 13 frames (socketcan, refuse), acknowledged by the drives"; empty on RS-485,
/// and for the default.
std::string host_side_text(const BusConfig& bus) {
  const bool usual = bus.host_queue.name == host_queues().front().name &&
                     bus.host_queue.full == host_queues().front().full && !bus.always_acknowledged;
  if (bus.serial || usual) return "";
  const auto& [name, frames, full] = bus.host_queue;
  return fmt::format(", queue of {} frames ({}, {}), acknowledged by {}", frames, name,
                     kQueueFullWords[static_cast<std::size_t>(full)],
                     bus.always_acknowledged ? "another node" : "the drives");
}

/// Returns ", adapter ch348"; empty without an adapter model.
std::string adapter_text(const BusConfig& bus) {
  return bus.adapter != nullptr ? fmt::format(", adapter {}", bus.adapter->name) : "";
}

std::string count(std::size_t n, const char* what) {
  return fmt::format("{} {}{}", n, what, n == 1 ? "" : "s");
}

/// Returns the generation's name, with " mixed" if some switches differ from it.
std::string generation_text(const ServoConfig& servo) {
  const bool mixed = !(servo.quirks == quirks_of(servo.generation, servo.quirks.dialect.framing));
  return std::string(generation_name(servo.generation)) + (mixed ? " mixed" : "");
}

/// Returns the turn that the encoder field spans: "rotor", "output"; empty without a gear.
std::string encoder_turn(const ServoConfig& servo) {
  if (servo.profile.drive.mechanics.gear_ratio == 1) return "";
  return encoder_turns(servo.profile, servo.quirks) == 1 ? "rotor" : "output";
}

std::string limit_of_loops(const ServoConfig& servo) {
  return servo.profile.series == Series::kMs
             ? fmt::format("{} permille", servo.rom.max_power_permille)
             : fmt::format("{} LSB", servo.rom.max_torque_current_lsb);
}

std::string load_text(const model::LoadParams& load) {
  std::vector<std::string> parts;
  if (load.J > 0) parts.push_back(number(load.J * 1e7) + " g cm2");
  if (load.tau != 0) parts.push_back(number(load.tau) + " Nm");
  if (load.tau_gravity != 0) parts.push_back("gravity " + number(load.tau_gravity) + " Nm");
  const model::LoadParams free;
  if (load.theta_min > free.theta_min || load.theta_max < free.theta_max) {
    parts.push_back(fmt::format("stops {:.4g}..{:.4g} deg", load.theta_min / kRadPerDeg,
                                load.theta_max / kRadPerDeg));
  }
  return parts.empty() ? kNone : fmt::format("{}", fmt::join(parts, ", "));
}

struct Column {
  const char* title;
  const char* unit;
  bool right;  // right-aligned
};
// clang-format off
constexpr std::array kColumns{
    Column{"id", "", true},
    Column{"motor", "", false},
    Column{"series", "", false},
    Column{"generation", "", false},
    Column{"gear", "", true},
    Column{"encoder", "bits", false},
    Column{"supply", "V", true},
    Column{"current", "or power", true},
    Column{"speed", "dps", true},
    Column{"accel.", "dps/s", true},
    Column{"angle", "deg", true},
    Column{"zero", "counts", true},
    Column{"boot", "deg", true},
    Column{"ROM", "ms", true},
    Column{"ROM", "writes", true},
    Column{"events", "", true},
    Column{"load", "", false},
};
// clang-format on
using Row = std::array<std::string, kColumns.size()>;

bool is_about(const Directive& directive, int id) {
  const auto* const set = std::get_if<SetFault>(&directive.what);
  return directive.id == id ||
         (set != nullptr && std::ranges::find(set->fault.ids, id) != set->fault.ids.end());
}

Row row_of(const ServoConfig& servo, const BusConfig& bus) {
  const auto events = static_cast<std::size_t>(std::count_if(
      bus.events.begin(), bus.events.end(),
      [&](const TimedDirective& event) { return is_about(event.directive, servo.id); }));
  const Registers& rom = servo.rom;
  return {std::to_string(servo.id),
          servo.profile.name,
          protocol::name_of(servo.profile.series),
          generation_text(servo),
          number(servo.profile.drive.mechanics.gear_ratio),
          fmt::format("{} {}", wire_bits(servo.profile.drive.encoder), encoder_turn(servo)),
          number(servo.profile.drive.supply.v_source),
          limit_of_loops(servo),
          number(rom.max_speed_dps),
          limit(rom.acceleration_dps_s),
          limit(rom.max_angle_deg),
          std::to_string(rom.encoder_offset),
          servo.boot_angle_deg ? number(*servo.boot_angle_deg) : "drawn",
          number(std::chrono::duration<double, std::milli>(servo.flash.write_time).count()),
          std::to_string(servo.flash.endurance),
          events == 0 ? kNone : std::to_string(events),
          load_text(servo.profile.drive.load)};
}

std::string print_row(const Row& row, const std::array<std::size_t, kColumns.size()>& widths) {
  std::string line;
  for (std::size_t k = 0; k < row.size(); ++k) {
    line += kColumns[k].right ? fmt::format("  {:>{}}", row[k], widths[k])
                              : fmt::format("  {:<{}}", row[k], widths[k]);
  }
  return line.substr(0, line.find_last_not_of(' ') + 1) + "\n";
}

/// Returns the column widths of all rows: equal for all buses, so that their columns align.
std::array<std::size_t, kColumns.size()> widths_of(const std::vector<Row>& rows) {
  std::array<std::size_t, kColumns.size()> widths{};
  for (const Row& row : rows) {
    for (std::size_t k = 0; k < row.size(); ++k) widths[k] = std::max(widths[k], row[k].size());
  }
  return widths;
}

/// Adds a note if a loop rings. Checks the speed loop first, as the position loop contains it.
void add_ringing(const ServoConfig& servo, std::vector<std::string>& all) {
  const model::ControlSettings settings = control_settings(servo.rom);
  for (const Loop loop : {Loop::kSpeed, Loop::kPosition}) {
    const Margins m = loop_margins(servo.profile.drive, settings, loop);
    if (!is_ringing(m)) continue;
    all.push_back(
        fmt::format("the {} loop rings with these gains and this load: margins of {:.1f} "
                    "dB and {:.0f} degrees",
                    loop == Loop::kSpeed ? "speed" : "position", m.gain_dB, m.phase_deg));
    return;
  }
}

/// Returns notes on values that are valid but rarely intended.
std::vector<std::string> doubts(const ServoConfig& servo, const BusConfig& bus) {
  std::vector<std::string> all;
  const model::DriveParams& drive = servo.profile.drive;
  const Rating& rating = servo.profile.rating;
  const double supply_V = drive.supply.v_source;
  const double starts_V = drive.logic.v_reset + drive.logic.v_reset_hysteresis;
  if (supply_V < starts_V) {
    all.push_back(fmt::format("does not start below {} V, its supply is {} V", number(starts_V),
                              number(supply_V)));
  } else if (rating.voltage_max_V > 0 &&
             (supply_V < rating.voltage_min_V || supply_V > rating.voltage_max_V)) {
    all.push_back(fmt::format("supply of {} V, the vendor says {} to {} V", number(supply_V),
                              number(rating.voltage_min_V), number(rating.voltage_max_V)));
  }
  if (servo.rom.broadcast_mode && servo.id > 4) {
    all.emplace_back("multi-drive mode, and 0x280 has no slot for this ID");
  }
  const std::string place =
      place_note(servo, bus, [](const ServoConfig& one) { return drive_address(one.rom, one); });
  if (!place.empty()) all.push_back(place + " (its ROM; --wipe-rom brings it back)");
  if (servo.quirks.dialect.pid_commands && servo.quirks.dialect.parameter_commands) {
    all.emplace_back("answers 0x30 and 0xC0; no known drive does both");
  }
  add_ringing(servo, all);
  return all;
}

/// Returns notes on properties that have no column in the table.
std::vector<std::string> remarks(const ServoConfig& servo) {
  std::vector<std::string> all;
  const auto switches = differing_switches(servo.generation, servo.quirks);
  if (!switches.empty()) {
    all.push_back(
        fmt::format("unlike {}: {}", generation_name(servo.generation), fmt::join(switches, ", ")));
  }
  if (servo.rom.broadcast_mode && servo.id <= 4) all.emplace_back("multi-drive mode");
  if (servo.profile.drive.brake.tau > 0) {
    all.push_back(fmt::format("brake of {} mNm", number(servo.profile.drive.brake.tau * 1e3)));
  }
  std::vector<std::string> on;
  std::vector<std::string> off;
  for (std::size_t kind = 0; kind < servo.rom.protections.size(); ++kind) {
    const bool enabled = servo.rom.protections[kind].enabled;
    if (enabled == servo.profile.factory.protections[kind].enabled) continue;
    (enabled ? on : off).emplace_back(profile_fields::kProtections[kind].name);
  }
  if (!on.empty()) all.push_back(fmt::format("protections on: {}", fmt::join(on, ", ")));
  if (!off.empty()) all.push_back(fmt::format("protections off: {}", fmt::join(off, ", ")));
  return all;
}

/// Returns where the reply to `opcode` has its first field in `unit`: "0x9A voltage 0.1 V in bytes
/// 3-4", on RS-485 "in D[2:3]".
std::string place_text(protocol::Opcode opcode, protocol::Unit unit, const char* symbol,
                       const protocol::WireFormat& format) {
  const auto byte = static_cast<std::uint8_t>(opcode);
  const bool serial = format.dialect.framing == protocol::Framing::kSerial;
  const auto fields = protocol::find_command(byte, format.dialect.framing)->reply;
  const auto field = std::ranges::find_if(fields, [&](const protocol::Field& one) {
    return one.unit == unit && protocol::present(one, {}, format);
  });
  const int first = field->byte;
  const int last = first + static_cast<int>(protocol::bytes_of(field->wire)) - 1;
  return fmt::format("0x{:02X} {} {}{} in {}", byte, small_letters(std::string(field->label)),
                     number(protocol::lsb(field->scale, format)), symbol,
                     serial ? fmt::format("D[{}:{}]", first - 1, last - 1)
                            : fmt::format("bytes {}-{}", first, last));
}

}  // namespace

std::string place_note(const ServoConfig& servo, const BusConfig& bus,
                       const AddressOf& address_of) {
  const DriveAddress address = address_of(servo);
  if (!is_on_its_bus(address, servo)) {
    constexpr const char* kBuses[] = {"no bus", "RS-485", "CAN"};
    return fmt::format("is silent, as it is set to {}",
                       kBuses[static_cast<std::size_t>(address.bus)]);
  }
  if (!is_at_its_rate(address, servo)) {
    return fmt::format("receives nothing, as it is set to {} bit/s",
                       bus.serial ? serial_rate_of(address.serial_rate, bus.serial->has_921600)
                                  : can_rate_of(address.can_rate));
  }
  if (address.id == servo.id) return "";
  const std::vector<int> others = sharing_drives(bus, servo.id, address_of);
  std::string shared;
  if (others.size() == 1) shared = fmt::format(", as drive {} does", others.front());
  if (others.size() > 1) shared = fmt::format(", as drives {} do", fmt::join(others, ", "));
  return fmt::format("answers at ID {}{}", address.id, shared);
}

std::vector<std::string> protocol_summary(const BusConfig& bus) {
  std::map<std::string, std::string> ids_by_text;
  for (const ServoConfig& servo : bus.servos) {
    const auto format = protocol::wire_format(servo.quirks.dialect, servo.profile.series);
    const std::string turn = encoder_turn(servo);
    const std::string text = fmt::format(
        "{}: {}, {}, encoder {} bits a turn{}", generation_text(servo),
        place_text(protocol::ReadState1::kOpcode, protocol::Unit::kVolt, " V", format),
        place_text(protocol::ReadSingleTurnAngle::kOpcode, protocol::Unit::kDegree, "°", format),
        wire_bits(servo.profile.drive.encoder), turn.empty() ? "" : " of the " + turn);
    std::string& ids = ids_by_text[text];
    ids += (ids.empty() ? "" : ",") + std::to_string(servo.id);
  }
  std::vector<std::string> lines;
  for (const auto& [text, ids] : ids_by_text) {
    lines.push_back(fmt::format("{}:{}: {}", bus.interface, ids, text));
  }
  return lines;
}

std::vector<std::string> generation_hints(const std::vector<BusConfig>& buses) {
  std::vector<std::string> lines;
  for (const auto& bus : buses) {
    for (const auto& servo : bus.servos) {
      const auto seen = servo.profile.seen_generation;
      const bool plain =
          !servo.generation_given && servo.quirks.dialect == protocol::kLegacyDialect;
      if (!plain || !seen || *seen == Generation::kLegacy) continue;
      std::string line = fmt::format(
          "{}: real drives of this motor use generation {}, this one uses legacy (--generation "
          "seen changes that)",
          servo.profile.name, generation_name(*seen));
      if (std::ranges::find(lines, line) == lines.end()) lines.push_back(std::move(line));
    }
  }
  return lines;
}

std::string describe_run(const std::vector<BusConfig>& buses) {
  Row titles;
  Row units;
  for (std::size_t k = 0; k < kColumns.size(); ++k) {
    titles[k] = kColumns[k].title;
    units[k] = kColumns[k].unit;
  }
  std::vector<Row> rows{titles, units};
  for (const auto& bus : buses) {
    for (const auto& servo : bus.servos) rows.push_back(row_of(servo, bus));
  }
  const auto widths = widths_of(rows);

  std::string text;
  std::string notes;
  std::size_t next = 2;
  for (const auto& bus : buses) {
    text +=
        fmt::format("{}{}: {}{}, {}, {}, seed {}{}\n", text.empty() ? "" : "\n", bus.interface,
                    bitrate_text(bus.bitrate), adapter_text(bus), count(bus.servos.size(), "drive"),
                    count(bus.events.size(), "event"), bus.seed, host_side_text(bus));
    text += print_row(titles, widths) + print_row(units, widths);
    for (const auto& servo : bus.servos) {
      text += print_row(rows[next++], widths);
      auto notes_of_drive = doubts(servo, bus);
      for (auto& remark : remarks(servo)) notes_of_drive.push_back(std::move(remark));
      for (const auto& text_of_note : notes_of_drive) {
        notes += fmt::format("note: {} drive {}: {}\n", bus.interface, servo.id, text_of_note);
      }
    }
  }
  return text + (notes.empty() ? "" : "\n") + notes;
}

}  // namespace lk::emulator
