#include "emulator/config/config.hpp"

#include <algorithm>
#include <functional>
#include <set>
#include <utility>

#include "emulator/config/bus_name.hpp"
#include "emulator/config/config_body.hpp"
#include "emulator/config/config_drive.hpp"
#include "emulator/config/config_reader.hpp"
#include "emulator/config/config_serial.hpp"
#include "emulator/config/events/config_directives.hpp"
#include "emulator/core/servo/signals.hpp"

namespace lk::emulator {
namespace {

/// Returns true if `request` refers to the file's bus on `interface`. The names are equal, or
/// command line and file have one bus each (`one_in_each`).
bool means(const BusRequest& request, const std::string& interface, bool one_in_each) {
  return request.interface == interface || one_in_each;
}

FirmwareRequest merge(FirmwareRequest all, const FirmwareRequest& of_bus) {
  if (of_bus.generation) all.generation = of_bus.generation;
  for (const auto& [key, value] : of_bus.quirks) all.quirks[key] = value;
  return all;
}

BusOptions options_by(const BusRequest& request, const Overrides& overrides) {
  return {.interface = request.interface,
          .ids = request.ids,
          .firmware = merge(overrides.firmware, request.firmware),
          .boot_angle_deg = overrides.boot_angle_deg};
}
/// Adds the properties of `bus` to the options.
BusOptions on_bus(BusOptions options, const BusConfig& bus) {
  options.serial = bus.serial ? &*bus.serial : nullptr;
  options.bitrate = bus.bitrate;
  return options;
}

// --- configuration file

/// Options of the command line for the drives of one bus of the file.
BusOptions options_of_bus(const Overrides& overrides, const std::string& interface,
                          std::size_t buses_in_file) {
  const bool one_in_each = overrides.buses.size() == 1 && buses_in_file == 1;
  for (const BusRequest& request : overrides.buses) {
    if (means(request, interface, one_in_each)) return options_by(request, overrides);
  }
  if (overrides.buses.empty()) return options_by({interface, std::nullopt}, overrides);
  return {.interface = interface, .ids = std::vector<int>{}};  // this bus does not run
}

/// The body of a robot. `taken` marks the joints that already have a drive.
struct Body {
  std::shared_ptr<const Mechanism> mechanism;
  std::shared_ptr<const BodySignals> signals;
  std::vector<bool> taken;
};

/// Reads the hosts' side of a CAN bus: queue and acknowledgement.
void read_host_side(TableReader& reader, BusConfig& bus) {
  for (const char* key : {"tx_queue", "tx_full", "acknowledged_by"}) {
    if (bus.serial && reader.has(key)) reader.fail(key, "belongs to CAN");
  }
  if (reader.is_integer("tx_queue")) {
    const auto frames = reader.integer("tx_queue", 1, HostQueue::kMaxFrames);
    bus.host_queue = {"custom", static_cast<std::size_t>(*frames), QueueFull::kDropNewest};
  } else {
    std::vector<std::string> names;
    for (const HostQueue& queue : host_queues()) names.emplace_back(queue.name);
    if (const auto n = reader.choice("tx_queue", names)) bus.host_queue = host_queues()[*n];
  }
  if (const auto n = reader.choice("tx_full", {kQueueFullWords.begin(), kQueueFullWords.end()})) {
    bus.host_queue.full = static_cast<QueueFull>(*n);
  }
  bus.always_acknowledged = reader.choice("acknowledged_by", {"drives", "always"}).value_or(0) == 1;
}

BusConfig read_bus(TableReader& reader, std::int64_t file_bitrate, std::size_t buses_in_file,
                   const Overrides& overrides, const FindProfile& find, Body& body) {
  BusConfig bus;
  bus.body = body.mechanism;
  bus.body_signals = body.signals;
  bus.interface = reader.required("interface", reader.text("interface"));
  const std::string wrong = interface_name_problem(bus.interface);
  if (reader.has("interface") && !wrong.empty()) reader.fail("interface", wrong);
  std::vector<std::string> adapters;
  for (const AdapterProfile& profile : adapter_profiles()) adapters.emplace_back(profile.name);
  if (const auto place = reader.choice("adapter", adapters)) {
    bus.adapter = &adapter_profiles()[*place];
  }
  const bool serial = is_serial_name(bus.interface);
  if (serial) bus.serial = read_serial(reader, bus.interface);
  read_host_side(reader, bus);
  bus.bitrate = serial ? kDefaultBaud : file_bitrate;
  if (const auto bitrate = reader.integer("bitrate", 0, INT64_MAX)) bus.bitrate = *bitrate;
  const std::string problem = serial ? baud_problem(bus.bitrate) : bitrate_problem(bus.bitrate);
  if (!problem.empty()) reader.fail("bitrate", problem);
  if (const auto& asked_rate = serial ? overrides.baud : overrides.bitrate) {
    bus.bitrate = *asked_rate;
  }
  BusOptions options = on_bus(options_of_bus(overrides, bus.interface, buses_in_file), bus);
  options.body = body.mechanism.get();
  std::set<int> seen;
  for (auto& drive : reader.tables("drive")) {
    for (auto& servo : read_drive(drive, overrides, options, find)) {
      if (!seen.insert(servo.id).second) {
        drive.fail(ids_key(drive),
                   "ID " + std::to_string(servo.id) + " is given twice on this bus");
      }
      check_joint(drive, servo, body.taken);
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
                                  const FindProfile& find, const LoadBody& load_body) {
  // Users confuse robots and scenarios; an error about an unknown key would not help them.
  if (!reader.has("bus") && (reader.has("expect") || reader.has("robot"))) {
    reader.fail("", "this is a scenario, not a robot; lk-emu run FILE plays it");
  }
  const auto seed = reader.integer("seed", 0, INT64_MAX);
  const std::int64_t bitrate = reader.integer("bitrate", 0, INT64_MAX).value_or(kDefaultBitrate);
  const std::string problem = bitrate_problem(bitrate);
  if (!problem.empty()) reader.fail("bitrate", problem);
  Body body{read_body(reader, load_body), {}, {}};
  if (body.mechanism) {
    BodyState beginning;
    body.mechanism->read_state(beginning);
    body.signals = std::make_shared<BodySignals>(body.mechanism->parts(), std::move(beginning));
    body.taken.resize(body.mechanism->joints().size());
  }
  const double battery_R_ohm = read_battery(reader);
  std::vector<BusConfig> buses;
  std::set<std::string> seen;
  std::vector<TableReader> tables = reader.tables("bus");
  for (auto& table : tables) {
    buses.push_back(read_bus(table, bitrate, tables.size(), overrides, find, body));
    if (!seen.insert(buses.back().interface).second) {
      table.fail("interface", "bus " + buses.back().interface + " is given twice");
    }
    buses.back().battery_R_ohm = battery_R_ohm;
    buses.back().seed = seed ? static_cast<std::uint64_t>(*seed) : kDefaultSeed;
  }
  if (buses.empty()) reader.note_missing("bus");
  reader.finish();
  const auto is_serial = [](const BusConfig& bus) { return bus.serial.has_value(); };
  if (reader.has("bitrate") && std::ranges::all_of(buses, is_serial)) {
    reader.fail("bitrate", "has no effect: no bus is CAN, and those of RS-485 have their own");
  }
  // A command line that selects buses may leave out the drives that turn joints.
  const bool whole = overrides.buses.empty();
  if (body.mechanism && whole && std::ranges::none_of(body.taken, std::identity())) {
    reader.fail("body",
                "no drive turns a joint of the body: give a drive `joint`, or remove [body]");
  }
  return buses;
}

// --- command line

/// Returns the index in `of_file` of the bus to which `request` refers; nullopt if none.
std::optional<std::size_t> place_of(const BusRequest& request,
                                    const std::vector<BusConfig>& of_file, bool one_in_each) {
  const auto found = std::ranges::find_if(
      of_file, [&](const BusConfig& bus) { return means(request, bus.interface, one_in_each); });
  if (found == of_file.end()) return std::nullopt;
  return static_cast<std::size_t>(found - of_file.begin());
}

void select_ids(BusConfig& bus, const BusRequest& request, const Overrides& overrides,
                const FindProfile& find) {
  const std::vector<int>& ids = *request.ids;
  const BusOptions options = on_bus(options_by(request, overrides), bus);
  std::vector<ServoConfig> servos;
  for (const int id : ids) {
    const auto known = std::find_if(bus.servos.begin(), bus.servos.end(),
                                    [id](const ServoConfig& servo) { return servo.id == id; });
    servos.push_back(known != bus.servos.end()
                         ? *known
                         : make_servo(id, find(overrides.motor.value_or(kDefaultMotor)), options));
  }
  bus.servos = std::move(servos);
  const auto gone = [&ids](int id) { return std::ranges::find(ids, id) == ids.end(); };
  std::erase_if(bus.events, [&](TimedDirective& event) {
    if (event.when && gone(event.when->id)) return true;
    auto* const set = std::get_if<SetFault>(&event.directive.what);
    if (set == nullptr || set->fault.ids.empty()) {
      return event.directive.id != kWholeBus && gone(event.directive.id);
    }
    std::erase_if(set->fault.ids, gone);
    return set->fault.ids.empty();
  });
}

/// Rejects a bit rate of the command line that applies to no bus.
void check_rates(const Overrides& overrides, const std::vector<BusConfig>& buses) {
  const auto is_serial = [](const BusConfig& bus) { return bus.serial.has_value(); };
  if (buses.empty()) return;
  if (overrides.baud && std::ranges::none_of(buses, is_serial)) {
    throw std::invalid_argument("--baud: no bus is RS-485; CAN has --bitrate");
  }
  if (overrides.bitrate && std::ranges::all_of(buses, is_serial)) {
    throw std::invalid_argument("--bitrate: no bus is CAN; RS-485 has --baud");
  }
}

std::vector<BusConfig> apply(const Overrides& overrides, std::vector<BusConfig> of_file,
                             const FindProfile& find) {
  for (std::size_t i = 0; i < of_file.size(); ++i) {
    of_file[i].seed = bus_seed(overrides.seed.value_or(of_file[i].seed), i);
  }
  std::vector<BusConfig> buses;
  const bool one_in_each = overrides.buses.size() == 1 && of_file.size() == 1;
  std::size_t next_place = of_file.size();  // for buses that are not in the file
  for (const auto& request : overrides.buses) {
    BusConfig bus;
    if (const auto place = place_of(request, of_file, one_in_each)) {
      bus = of_file[*place];
    } else {
      bus.seed = bus_seed(overrides.seed.value_or(kDefaultSeed), next_place++);
      if (is_serial_name(request.interface)) {
        bus.serial = SerialConfig{};
        bus.bitrate = overrides.baud.value_or(kDefaultBaud);
      } else {
        bus.bitrate = overrides.bitrate.value_or(kDefaultBitrate);
      }
    }
    if (is_serial_name(request.interface) != bus.serial.has_value()) {
      throw std::invalid_argument("--bus " + request.interface + ": the file has " + bus.interface +
                                  ", which is another wire");
    }
    bus.interface = request.interface;
    if (request.ids) select_ids(bus, request, overrides, find);
    if (bus.servos.empty()) {
      throw std::invalid_argument("bus " + request.interface + " has no drives: give it --ids");
    }
    buses.push_back(std::move(bus));
  }
  if (overrides.buses.empty()) buses = std::move(of_file);
  check_rates(overrides, buses);
  return buses;
}

}  // namespace

std::string interface_name_problem(const std::string& name) {
  const auto parsed = parse_bus_name(name);
  const auto* const problem = std::get_if<std::string>(&parsed);
  return problem != nullptr ? *problem : "";
}

std::string bitrate_problem(std::int64_t bitrate) {
  if (bitrate == 0 || (bitrate >= 10'000 && bitrate <= 1'000'000)) return "";
  return std::to_string(bitrate) + " is out of range (0, or 10000 to 1000000 bit/s)";
}

std::vector<BusConfig> parse_config(const std::string& text, const std::string& file,
                                    const Overrides& overrides, const FindProfile& find_profile,
                                    const LoadBody& load_body) {
  const toml::table document = parse_toml(text, file);
  TableReader reader(document, file, "");
  return apply(overrides, read_buses(reader, overrides, find_profile, load_body), find_profile);
}

std::vector<BusConfig> default_config(const Overrides& overrides, const FindProfile& find_profile) {
  std::vector<BusConfig> buses = apply(overrides, {}, find_profile);
  if (buses.empty())
    throw std::invalid_argument("no bus: give --bus vcan0 --ids 1-4, or --config FILE");
  return buses;
}

}  // namespace lk::emulator
