#include "emulator/config/scenario/config_scenario.hpp"

#include <algorithm>

#include "emulator/config/config_quirks.hpp"
#include "emulator/config/events/config_directives.hpp"
#include "emulator/core/scenario/scenario_text.hpp"
#include "emulator/core/text.hpp"

namespace lk::emulator {
namespace {

std::string names_of(const std::vector<BusConfig>& robot) {
  std::string all;
  for (const BusConfig& bus : robot) all += (all.empty() ? "" : ", ") + bus.interface;
  return all;
}

/// Reads one [[event]]. Without the key `bus`, the drives of the event determine the bus.
void read_event(TableReader& reader, Scenario& scenario) {
  std::optional<int> id;
  if (const auto ids = read_ids(reader); !ids.empty()) id = ids.front();
  BusConfig& bus = scenario.robot[read_bus_of(reader, scenario.robot, id)];
  read_moment(reader, "at_s", scenario.duration);
  for (TimedDirective& directive : read_directives(reader, bus, Timing::kRequired)) {
    bus.events.push_back(std::move(directive));
  }
  check_room(reader, bus.events);
}

/// Checks that each `clear` names a fault on its bus, from the robot's file or the scenario.
/// `running`: the robot's buses if they already run, otherwise empty.
void check_clears(std::vector<TableReader>& events, const Scenario& scenario,
                  const std::vector<BusConfig>& running) {
  for (TableReader& event : events) {
    if (!event.is_text("clear")) continue;
    const std::size_t bus = read_bus_of(event, scenario.robot, std::nullopt);
    std::vector<TimedDirective> all;
    if (!running.empty()) all = running[bus].events;
    const auto& planned = scenario.robot[bus].events;
    all.insert(all.end(), planned.begin(), planned.end());
    check_clear(event, *event.text("clear"), all);
  }
}

void read_robot(TableReader& reader, std::optional<std::uint64_t> seed, const ScenarioFiles& files,
                Scenario& scenario) {
  Overrides overrides;
  const auto of_file = reader.integer("seed", 0, INT64_MAX);
  if (of_file) overrides.seed = static_cast<std::uint64_t>(*of_file);
  if (seed) overrides.seed = seed;
  if (const auto bitrate = reader.integer("bitrate", 0, INT64_MAX)) {
    const std::string problem = bitrate_problem(*bitrate);
    if (!problem.empty()) reader.fail("bitrate", problem);
    overrides.bitrate = bitrate;
  }
  if (const auto word = reader.choice("generation", generation_words())) {
    overrides.firmware.generation = generation_words()[*word];
  }
  scenario.robot_name = reader.required("robot", reader.text("robot"));
  if (!reader.has("robot")) return;
  try {
    scenario.robot = files.robot(scenario.robot_name, overrides);
  } catch (const ConfigError&) {
    throw;
  } catch (const std::exception& problem) {
    reader.fail("robot", problem.what());
  }
}

/// Reads everything but the robot. `running`: the robot's buses if they already run, otherwise
/// empty.
void read_course(TableReader& reader, const ScenarioFiles& files,
                 const std::vector<BusConfig>& running, Scenario& scenario) {
  for (BusConfig& bus : scenario.robot) {
    // Removes events of the robot's file that are after the scenario's end.
    std::erase_if(bus.events,
                  [&](const TimedDirective& event) { return event.at > scenario.duration; });
  }
  auto events = reader.tables("event");
  for (auto& event : events) read_event(event, scenario);
  for (BusConfig& bus : scenario.robot) {
    std::ranges::stable_sort(bus.events, {}, &TimedDirective::at);
  }
  check_clears(events, scenario, running);
  for (auto& send : reader.tables("send")) {
    const std::vector<HostSend> frames = read_send(send, scenario, files);
    scenario.sends.insert(scenario.sends.end(), frames.begin(), frames.end());
  }
  for (auto& expect : reader.tables("expect")) {
    scenario.expectations.push_back(read_expectation(expect, scenario));
  }
  if (scenario.expectations.empty()) {
    reader.note_missing("expect");
  }
}

/// Rejects a robot file. Users confuse robots and scenarios; an error about an unknown key would
/// not help them.
void refuse_robot(const TableReader& reader) {
  if (!reader.has("bus") || reader.has("expect") || reader.has("robot")) return;
  reader.fail("", "this is a robot, not a scenario; lk-emu --config FILE runs it");
}

void read_head(TableReader& reader, const std::string& file, Scenario& scenario) {
  const std::size_t slash = file.find_last_of('/');
  scenario.name = sanitized_line(file.substr(slash == std::string::npos ? 0 : slash + 1));
  if (scenario.name.ends_with(".toml")) scenario.name.resize(scenario.name.size() - 5);
  scenario.about = reader.text("about").value_or("");
  scenario.duration = reader.required("duration_s", read_duration(reader, "duration_s"));
  if (reader.has("duration_s") && scenario.duration == SimTime{0}) {
    reader.fail("duration_s", "must be above 0");
  }
}

/// Checks the required keys of a file; reports an unknown key first.
void check_head(TableReader& reader) {
  for (const char* key : {"event", "send", "expect"}) reader.tables(key);
  reader.finish();
}

/// Returns the drives of `robot` that are missing in `running` or have another motor there. `known`
/// has the buses of `running` in the same order, with the bus names of the scenario.
std::vector<DriveMismatch> drive_mismatches(const std::vector<BusConfig>& robot,
                                            const std::vector<BusConfig>& known,
                                            const std::vector<BusConfig>& running) {
  std::vector<DriveMismatch> mismatches;
  for (const BusConfig& meant : robot) {
    const auto found = std::ranges::find(known, meant.interface, &BusConfig::interface);
    const BusConfig* const here =
        found == known.end() ? nullptr : &running[static_cast<std::size_t>(found - known.begin())];
    for (const ServoConfig& servo : meant.servos) {
      std::string motor;
      const ServoConfig* const drive = here != nullptr ? find_servo(*here, servo.id) : nullptr;
      if (drive != nullptr) motor = drive->profile.name;
      if (motor == servo.profile.name) continue;
      mismatches.push_back({here != nullptr ? here->interface : meant.interface, servo.id,
                            servo.profile.name, motor});
    }
  }
  return mismatches;
}

/// If no running bus has a name from the robot's file, gives the buses of `scenario` its names, in
/// its order. Sets Scenario::mismatches.
void take_names_of_robot(TableReader& reader, const ScenarioFiles& files,
                         const std::vector<BusConfig>& running, Scenario& scenario) {
  const auto name = reader.text("robot");
  if (!name) return;
  scenario.robot_name = *name;
  std::vector<BusConfig> of_file;
  try {
    of_file = files.robot(*name, {});
  } catch (const std::exception&) {
    return;  // the robot's file is not needed: the buses already run
  }
  const bool known = std::ranges::any_of(of_file, [&](const BusConfig& bus) {
    return std::ranges::find(scenario.robot, bus.interface, &BusConfig::interface) !=
           scenario.robot.end();
  });
  if (!known && of_file.size() == scenario.robot.size()) {
    for (std::size_t n = 0; n < of_file.size(); ++n) {
      scenario.robot[n].interface = of_file[n].interface;
    }
  }
  scenario.mismatches = drive_mismatches(of_file, scenario.robot, running);
}

}  // namespace

Scenario parse_scenario(const std::string& text, const std::string& file,
                        std::optional<std::uint64_t> seed, const ScenarioFiles& files) {
  return parse_scenario(parse_toml(text, file), file, seed, files);
}

Scenario parse_scenario(const toml::table& document, const std::string& file,
                        std::optional<std::uint64_t> seed, const ScenarioFiles& files) {
  TableReader reader(document, file, "");
  refuse_robot(reader);
  Scenario scenario;
  read_head(reader, file, scenario);
  read_robot(reader, seed, files, scenario);
  check_head(reader);
  read_course(reader, files, {}, scenario);
  reader.finish();
  return scenario;
}

Scenario parse_live_scenario(const std::string& text, const std::string& file,
                             const std::vector<BusConfig>& running, const ScenarioFiles& files) {
  const toml::table document = parse_toml(text, file);
  TableReader reader(document, file, "");
  refuse_robot(reader);
  Scenario scenario;
  read_head(reader, file, scenario);
  reader.integer("seed", 0, INT64_MAX);
  reader.integer("bitrate", 0, INT64_MAX);
  reader.choice("generation", generation_words());
  scenario.robot = running;
  for (BusConfig& bus : scenario.robot) bus.events.clear();
  take_names_of_robot(reader, files, running, scenario);
  check_head(reader);
  read_course(reader, files, running, scenario);
  reader.finish();
  for (std::size_t n = 0; n < running.size(); ++n) {
    scenario.robot[n].interface = running[n].interface;
  }
  return scenario;
}

std::size_t read_bus_of(TableReader& reader, const std::vector<BusConfig>& robot,
                        std::optional<int> id) {
  if (const auto name = reader.text("bus")) {
    const auto found = std::ranges::find(robot, *name, &BusConfig::interface);
    if (found == robot.end()) {
      reader.fail("bus", "\"" + *name + "\" is not one of " + names_of(robot));
    }
    return static_cast<std::size_t>(found - robot.begin());
  }
  if (robot.size() == 1) return 0;
  std::vector<std::size_t> places;
  for (std::size_t n = 0; id && n < robot.size(); ++n) {
    if (find_servo(robot[n], *id) != nullptr) places.push_back(n);
  }
  if (id && places.empty()) {
    reader.fail(ids_key(reader), "no drive " + std::to_string(*id) + " on any bus");
  }
  if (places.size() != 1) reader.fail("bus", "ambiguous; give one of " + names_of(robot));
  return places.front();
}

std::optional<SimTime> read_moment(TableReader& reader, const std::string& key, SimTime duration) {
  const auto moment = read_duration(reader, key);
  if (moment && *moment > duration) {
    reader.fail(key, "is after the end of the scenario, " + time_text(duration));
  }
  return moment;
}

}  // namespace lk::emulator
