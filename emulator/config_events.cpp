#include "emulator/config_events.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "emulator/config_ids.hpp"
#include "emulator/profile.hpp"

namespace lk::emulator {
namespace {

constexpr double kLongest_s = 1e8;  // three years; SimTime holds 292
constexpr double kHighestSupply_V = 100;

SimTime sim_time(double seconds) { return SimTime(std::llround(seconds * 1e9)); }

using Action = decltype(Directive::what);

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

Action read_power(TableReader& reader, std::size_t word) {
  const auto off = reader.number("off_s", 0, kLongest_s);
  if (off && word != 2) reader.fail("off_s", "belongs to power = \"cycle\"");
  if (word == 0) return PowerOn{};
  if (word == 1) return PowerOff{};
  PowerCycle cycle;
  if (off) cycle.off_for = sim_time(*off);
  return cycle;
}

std::optional<Action> read_action(TableReader& reader) {
  std::optional<Action> action;
  if (const auto word = reader.choice("power", {"on", "off", "cycle"})) {
    action = read_power(reader, *word);
  }
  if (const auto volts = reader.number("supply_V", 0, kHighestSupply_V)) {
    const double ramp = reader.number("ramp_s", 0, kLongest_s).value_or(0);
    action = SupplyVoltage{*volts, sim_time(ramp)};
  }
  if (const auto volts = reader.number("sag_to_V", 0, kHighestSupply_V)) {
    const auto lasts = reader.number("sag_s", 0, kLongest_s);
    if (!lasts) reader.note_missing("sag_s");
    action = Sag{*volts, sim_time(lasts.value_or(0))};
  }
  if (const auto ambient = reader.number("ambient_C", -40, 125)) {
    action = AmbientTemperature{*ambient};
  }
  if (reader.has("load")) {
    Load load;
    read_load(reader, load.load);
    action = load;
  }
  if (const auto turn = reader.number("turn_deg", -1e6, 1e6)) {
    action = TurnShaft{*turn};
  }
  return action;
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
  const std::optional<Action> action = read_action(reader);
  reader.finish();
  if (!action) {
    reader.fail("at_s",
                "an event needs an action: power, supply_V, sag_to_V, ambient_C, load or "
                "turn_deg");
  }
  for (const ServoConfig* servo : targets) {
    bus.events.push_back({sim_time(*at), {servo->id, *action}});
  }
}

}  // namespace

void read_events(TableReader& reader, BusConfig& bus) {
  for (auto& event : reader.tables("event")) read_event(event, bus);
  std::stable_sort(bus.events.begin(), bus.events.end(),
                   [](const TimedDirective& a, const TimedDirective& b) { return a.at < b.at; });
}

}  // namespace lk::emulator
