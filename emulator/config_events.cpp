#include "emulator/config_events.hpp"

#include <algorithm>
#include <cmath>

#include "emulator/config_ids.hpp"
#include "emulator/profile.hpp"

namespace lk::emulator {
namespace {

constexpr double kLongest_s = 1e8;  // three years; SimTime holds 292
constexpr double kHighestSupply_V = 100;

SimTime sim_time(double seconds) { return SimTime(std::llround(seconds * 1e9)); }

/// What happens to a drive, and how long after `at_s`.
struct Step {
  SimTime after{0};
  decltype(Directive::what) what;
  bool back = false;  // of a sag's end: `what` is the source of the drive's own
};

/// The keys that an action may have beside its own.
struct Companion {
  const char* key;
  const char* action;
  const char* reason;
};
constexpr Companion kCompanions[] = {
    {"off_s", "power", "belongs to power = \"cycle\""},
    {"ramp_s", "supply_V", "belongs to supply_V"},
    {"sag_s", "sag_to_V", "belongs to sag_to_V"},
};

constexpr const char* kActions[] = {"power",     "supply_V", "sag_to_V",
                                    "ambient_C", "load",     "turn_deg"};

/// Exactly one action, and nothing that belongs to another one.
void check_actions(TableReader& reader) {
  const char* first = nullptr;
  for (const char* action : kActions) {
    if (!reader.has(action)) continue;
    if (first != nullptr) {
      reader.fail(action, std::string("one action an event; this one has ") + first + " already");
    }
    first = action;
  }
  for (const auto& companion : kCompanions) {
    if (reader.has(companion.key) && !reader.has(companion.action)) {
      reader.fail(companion.key, companion.reason);
    }
  }
}

Step read_power(TableReader& reader, std::size_t word) {
  const auto off = reader.number("off_s", 0, kLongest_s);
  if (off && word != 2) reader.fail("off_s", "belongs to power = \"cycle\"");
  if (word == 0) return {.what = PowerOn{}};
  if (word == 1) return {.what = PowerOff{}};
  PowerCycle cycle;
  if (off) cycle.off_for = sim_time(*off);
  return {.what = cycle};
}

std::vector<Step> read_action(TableReader& reader) {
  std::vector<Step> steps;
  if (const auto word = reader.choice("power", {"on", "off", "cycle"})) {
    steps.push_back(read_power(reader, *word));
  }
  if (const auto volts = reader.number("supply_V", 0, kHighestSupply_V)) {
    const double ramp = reader.number("ramp_s", 0, kLongest_s).value_or(0);
    steps.push_back({.what = SupplyVoltage{*volts, sim_time(ramp)}});
  }
  if (const auto volts = reader.number("sag_to_V", 0, kHighestSupply_V)) {
    const auto lasts = reader.number("sag_s", 0, kLongest_s);
    if (!lasts) reader.note_missing("sag_s");
    steps.push_back({.what = SupplyVoltage{*volts}});
    steps.push_back({sim_time(lasts.value_or(0)), SupplyVoltage{}, true});
  }
  if (const auto ambient = reader.number("ambient_C", -40, 125)) {
    steps.push_back({.what = AmbientTemperature{*ambient}});
  }
  if (reader.has("load")) {
    Load load;
    read_load(reader, load.load);
    steps.push_back({.what = load});
  }
  if (const auto turn = reader.number("turn_deg", -1e6, 1e6)) {
    steps.push_back({.what = TurnShaft{*turn}});
  }
  return steps;
}

/// The drives that the event means.
std::vector<const ServoConfig*> read_targets(TableReader& reader, const BusConfig& bus) {
  const std::vector<int> ids = read_ids(reader);
  std::vector<const ServoConfig*> targets;
  for (const auto& servo : bus.servos) {
    if (ids.empty() || std::find(ids.begin(), ids.end(), servo.id) != ids.end()) {
      targets.push_back(&servo);
    }
  }
  for (const int id : ids) {
    const bool there = std::any_of(bus.servos.begin(), bus.servos.end(),
                                   [id](const ServoConfig& servo) { return servo.id == id; });
    if (!there) reader.fail(ids_key(reader), "no drive " + std::to_string(id) + " on this bus");
  }
  return targets;
}

void read_event(TableReader& reader, BusConfig& bus) {
  const auto at = reader.number("at_s", 0, kLongest_s);
  if (!at) reader.note_missing("at_s");
  const auto targets = read_targets(reader, bus);
  check_actions(reader);
  const std::vector<Step> steps = read_action(reader);
  reader.finish();
  if (steps.empty()) {
    reader.fail("at_s",
                "an event needs an action: power, supply_V, sag_to_V, ambient_C, load or "
                "turn_deg");
  }
  for (const Step& step : steps) {
    for (const ServoConfig* servo : targets) {
      TimedDirective timed{sim_time(*at) + step.after, {servo->id, step.what}};
      if (step.back) timed.directive.what = SupplyVoltage{servo->profile.drive.supply.v_source};
      bus.events.push_back(std::move(timed));
    }
  }
}

}  // namespace

void read_events(TableReader& reader, BusConfig& bus) {
  for (auto& event : reader.tables("event")) read_event(event, bus);
  std::stable_sort(bus.events.begin(), bus.events.end(),
                   [](const TimedDirective& a, const TimedDirective& b) { return a.at < b.at; });
}

}  // namespace lk::emulator
