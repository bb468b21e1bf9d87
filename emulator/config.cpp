#include "emulator/config.hpp"

#include <algorithm>
#include <charconv>
#include <set>

#include "emulator/config_reader.hpp"
#include "emulator/profile.hpp"

namespace lk::emulator {
namespace {

/// Two buses with the same IDs must not be copies of each other.
std::uint64_t bus_seed(std::uint64_t seed, std::size_t index) { return seed + index; }

ServoConfig make_servo(int id, const Profile& profile) {
  ServoConfig servo;
  servo.id = id;
  servo.profile = profile;
  servo.rom = profile.factory;
  return servo;
}

/// Whole decimal number, nothing around it.
int parse_id(const std::string& text) {
  int id = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), id);
  const bool whole = end == text.data() + text.size() && !text.empty();
  if (error == std::errc::result_out_of_range) id = kMaxId + 1;
  if (!whole) throw std::invalid_argument("\"" + text + "\" is not an ID; write 1-4 or 1,3,7-9");
  if (id < 1 || id > kMaxId) {
    throw std::invalid_argument("ID " + text + " is outside 1.." + std::to_string(kMaxId));
  }
  return id;
}

// --- the configuration file
// ---------------------------------------------------------------------------

std::vector<int> read_ids(TableReader& reader) {
  const auto id = reader.integer("id", 1, kMaxId);
  const auto ids = reader.text("ids");
  if (id && ids) reader.fail("ids", "give either id or ids");
  if (id) return {static_cast<int>(*id)};
  if (!ids) {
    reader.note_missing("id");
    return {};
  }
  try {
    return parse_ids(*ids);
  } catch (const std::invalid_argument& problem) {
    reader.fail("ids", problem.what());
  }
}

Profile read_profile(TableReader& reader, const Overrides& overrides, const FindProfile& find) {
  const std::string in_file = reader.text("motor").value_or(kDefaultMotor);
  try {
    return find(overrides.motor.value_or(in_file));
  } catch (const UnknownMotor& problem) {
    if (overrides.motor) throw;
    reader.fail("motor", problem.what());
  }
}

void read_quirks(TableReader& reader, Quirks& quirks) {
  auto found = reader.table("quirks");
  if (!found) return;
  const Field<Quirks> switches[] = {
      {"manual_reply_bytes", &Quirks::manual_reply_bytes},
      {"offset_write_takes_effect", &Quirks::offset_write_takes_effect},
      {"run_resumes", &Quirks::run_resumes},
      {"stop_holds", &Quirks::stop_holds},
  };
  read_fields<Quirks>(*found, switches, Presence::kOptional, quirks);
  if (const auto word = found->choice("clear_angle", {"ignored", "implemented", "sets_angle"})) {
    quirks.dialect.clear_angle = static_cast<protocol::ClearAngleMeaning>(*word);
  }
  found->finish();
}

void read_settings(TableReader& reader, ServoConfig& servo) {
  auto settings = reader.table("settings");
  if (!settings) return;
  read_registers(*settings, Presence::kOptional, servo.rom);
  const int wire_bits = std::min(servo.profile.drive.encoder.bits, 16);
  if (servo.rom.encoder_offset >= (1 << wire_bits)) {
    settings->fail("encoder_offset", "does not fit the encoder of this motor (" +
                                         std::to_string(wire_bits) + " bit on the wire)");
  }
  settings->finish();
}

/// The servos of one [[bus.drive]].
std::vector<ServoConfig> read_drive(TableReader& reader, const Overrides& overrides,
                                    const FindProfile& find) {
  const std::vector<int> ids = read_ids(reader);
  ServoConfig servo = make_servo(1, read_profile(reader, overrides, find));
  if (auto changes = reader.table("profile")) {
    read_drive_params(*changes, Presence::kOptional, servo.profile.drive);
    changes->finish();
  }
  if (const auto us = reader.integer("reply_time_us", 0, 100'000)) {
    servo.reply_time = std::chrono::microseconds(*us);
  }
  servo.boot_angle_deg = reader.number("boot_angle_deg", -360, 360);
  read_quirks(reader, servo.quirks);
  read_settings(reader, servo);
  read_load(reader, servo.profile.drive.load);
  reader.finish();

  std::vector<ServoConfig> servos;
  for (const int id : ids) {
    servo.id = id;
    servos.push_back(servo);
  }
  return servos;
}

BusConfig read_bus(TableReader& reader, std::int64_t file_bitrate, const Overrides& overrides,
                   const FindProfile& find) {
  BusConfig bus;
  bus.bitrate = file_bitrate;
  if (const auto bitrate = reader.integer("bitrate", 0, INT64_MAX)) bus.bitrate = *bitrate;
  const std::string problem = bitrate_problem(bus.bitrate);
  if (!problem.empty()) reader.fail("bitrate", problem);
  if (const auto interface = reader.text("interface")) {
    const std::string wrong = interface_name_problem(*interface);
    if (!wrong.empty()) reader.fail("interface", wrong);
    bus.interface = *interface;
  } else {
    reader.note_missing("interface");
  }
  std::set<int> seen;
  for (auto& drive : reader.tables("drive")) {
    for (auto& servo : read_drive(drive, overrides, find)) {
      if (!seen.insert(servo.id).second) {
        drive.fail(drive.has("ids") ? "ids" : "id",
                   "ID " + std::to_string(servo.id) + " is given twice on this bus");
      }
      bus.servos.push_back(std::move(servo));
    }
  }
  if (seen.empty()) reader.note_missing("drive");
  reader.finish();
  std::sort(bus.servos.begin(), bus.servos.end(),
            [](const ServoConfig& a, const ServoConfig& b) { return a.id < b.id; });
  return bus;
}

std::vector<BusConfig> read_buses(TableReader& reader, const Overrides& overrides,
                                  const FindProfile& find) {
  const auto seed = reader.integer("seed", 0, INT64_MAX);
  const std::int64_t bitrate = reader.integer("bitrate", 0, INT64_MAX).value_or(kDefaultBitrate);
  const std::string problem = bitrate_problem(bitrate);
  if (!problem.empty()) reader.fail("bitrate", problem);
  std::vector<BusConfig> buses;
  std::set<std::string> seen;
  for (auto& table : reader.tables("bus")) {
    buses.push_back(read_bus(table, bitrate, overrides, find));
    if (!seen.insert(buses.back().interface).second) {
      table.fail("interface", "bus " + buses.back().interface + " is given twice");
    }
    buses.back().seed = seed ? static_cast<std::uint64_t>(*seed) : kDefaultSeed;
  }
  if (buses.empty()) reader.note_missing("bus");
  reader.finish();
  return buses;
}

// --- what the command line says
// -----------------------------------------------------------------------

/// The bus of the file that `request` means: the one on that interface or, when the file and the
/// command line each name one bus only, that one, moved to the other interface.
BusConfig bus_meant(const BusRequest& request, const std::vector<BusConfig>& of_file, bool only) {
  for (const auto& bus : of_file) {
    if (bus.interface == request.interface) return bus;
  }
  BusConfig bus;
  if (only && of_file.size() == 1) bus = of_file.front();
  bus.interface = request.interface;
  return bus;
}

void select_ids(BusConfig& bus, const std::vector<int>& ids, const Overrides& overrides,
                const FindProfile& find) {
  std::vector<ServoConfig> servos;
  for (const int id : ids) {
    const auto known = std::find_if(bus.servos.begin(), bus.servos.end(),
                                    [id](const ServoConfig& servo) { return servo.id == id; });
    servos.push_back(known != bus.servos.end()
                         ? *known
                         : make_servo(id, find(overrides.motor.value_or(kDefaultMotor))));
  }
  bus.servos = std::move(servos);
}

std::vector<BusConfig> apply(const Overrides& overrides, std::vector<BusConfig> of_file,
                             const FindProfile& find) {
  std::vector<BusConfig> buses;
  const bool only = overrides.buses.size() == 1;
  for (const auto& request : overrides.buses) {
    BusConfig bus = bus_meant(request, of_file, only);
    if (request.ids) select_ids(bus, *request.ids, overrides, find);
    if (bus.servos.empty()) {
      throw std::invalid_argument("bus " + request.interface + " has no drives: give it --ids");
    }
    buses.push_back(std::move(bus));
  }
  if (overrides.buses.empty()) buses = std::move(of_file);
  for (std::size_t i = 0; i < buses.size(); ++i) {
    buses[i].seed = bus_seed(overrides.seed.value_or(buses[i].seed), i);
    if (overrides.bitrate) buses[i].bitrate = *overrides.bitrate;
  }
  return buses;
}

}  // namespace

std::vector<int> parse_ids(const std::string& text) {
  std::set<int> ids;
  for (std::size_t start = 0; start <= text.size();) {
    const std::size_t comma = std::min(text.find(',', start), text.size());
    const std::string part = text.substr(start, comma - start);
    const std::size_t dash = part.find('-');
    const int first = parse_id(part.substr(0, dash));
    const int last = dash == std::string::npos ? first : parse_id(part.substr(dash + 1));
    if (last < first) throw std::invalid_argument("the range " + part + " runs backwards");
    for (int id = first; id <= last; ++id) {
      if (!ids.insert(id).second) {
        throw std::invalid_argument("ID " + std::to_string(id) + " is given twice");
      }
    }
    start = comma + 1;
  }
  return {ids.begin(), ids.end()};
}

std::string interface_name_problem(const std::string& name) {
  constexpr std::size_t kLongest = 15;  // IFNAMSIZ - 1
  if (name.empty()) return "an interface needs a name";
  if (name.size() > kLongest) return "\"" + name + "\" is longer than an interface name can be";
  const bool plain = std::all_of(name.begin(), name.end(), [](char c) {
    return c > ' ' && c < '\x7f' && c != '/' && c != ':';
  });
  if (!plain || name == "." || name == "..") return "\"" + name + "\" is no interface name";
  return "";
}

std::string bitrate_problem(std::int64_t bitrate) {
  if (bitrate == 0 || (bitrate >= 10'000 && bitrate <= 1'000'000)) return "";
  return std::to_string(bitrate) + " is out of range (0, or 10000 to 1000000 bit/s)";
}

std::vector<BusConfig> parse_config(const std::string& text, const std::string& file,
                                    const Overrides& overrides, const FindProfile& find_profile) {
  const toml::table document = parse_toml(text, file);
  TableReader reader(document, file, "");
  return apply(overrides, read_buses(reader, overrides, find_profile), find_profile);
}

std::vector<BusConfig> default_config(const Overrides& overrides, const FindProfile& find_profile) {
  std::vector<BusConfig> buses = apply(overrides, {}, find_profile);
  if (buses.empty())
    throw std::invalid_argument("no bus: give --bus vcan0 --ids 1-4, or --config FILE");
  return buses;
}

}  // namespace lk::emulator
