#include "emulator/config.hpp"

#include <algorithm>
#include <set>

#include "emulator/config_drive.hpp"
#include "emulator/config_events.hpp"
#include "emulator/config_ids.hpp"
#include "emulator/config_reader.hpp"

namespace lk::emulator {
namespace {

/// Two buses with the same IDs must not be copies of each other.
std::uint64_t bus_seed(std::uint64_t seed, std::size_t index) { return seed + index; }

// --- the configuration file
// ---------------------------------------------------------------------------

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
        drive.fail(ids_key(drive),
                   "ID " + std::to_string(servo.id) + " is given twice on this bus");
      }
      bus.servos.push_back(std::move(servo));
    }
  }
  if (seen.empty()) reader.note_missing("drive");
  std::sort(bus.servos.begin(), bus.servos.end(),
            [](const ServoConfig& a, const ServoConfig& b) { return a.id < b.id; });
  read_events(reader, bus);
  reader.finish();
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
  std::erase_if(bus.events, [&](const TimedDirective& event) {
    return std::find(ids.begin(), ids.end(), event.directive.id) == ids.end();
  });
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
