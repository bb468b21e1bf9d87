#include "emulator/config/events/config_directives.hpp"

#include <algorithm>
#include <charconv>
#include <utility>

#include "emulator/config/config_checks.hpp"
#include "emulator/config/config_serial.hpp"
#include "emulator/config/events/config_body_acts.hpp"
#include "emulator/config/profile.hpp"
#include "emulator/config/register_fields.hpp"
#include "emulator/config/rom_file.hpp"
#include "emulator/core/servo/signals.hpp"
#include "protocol/rounding.hpp"

namespace lk::emulator {
namespace {

constexpr double kHighestSupply_V = 100;
constexpr std::size_t kLongestMark = 1000;

using Action = decltype(Directive::what);

/// A key that is allowed only together with a certain action.
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

constexpr const char* kActions[] = {"power",    "supply_V", "sag_to_V", "ambient_C", "load",
                                    "turn_deg", "settings", "fault",    "clear",     "push",
                                    "payload",  "freeze",   "floor",    "pose",      "mark"};
constexpr const char* kActionList =
    "power, supply_V, sag_to_V, ambient_C, load, turn_deg, settings, fault, clear, push, payload, "
    "freeze, floor, pose or mark";

/// Rejects more than one action.
void check_actions(TableReader& reader) {
  if (reader.has("clock")) {
    reader.fail("clock", "time is the running program's: --clock, or lk-emu ctl clock");
  }
  const char* first = nullptr;
  for (const char* action : kActions) {
    if (!reader.has(action)) continue;
    if (first != nullptr) {
      reader.fail(action,
                  std::string("only one action per event; this event has ") + first + " already");
    }
    first = action;
  }
}

/// Rejects unknown keys first, then keys of other actions: a misspelt action is then reported as
/// such.
void finish_event(TableReader& reader) {
  std::vector<const char*> tables = {"load", "settings", "fault"};
  tables.insert(tables.end(), std::begin(kBodyActs), std::end(kBodyActs));
  for (const char* action : tables) {
    if (!reader.has(action)) reader.table(action);  // so that it can be suggested
  }
  for (const auto& companion : kCompanions) {
    if (reader.has(companion.key)) read_duration(reader, companion.key);
  }
  reader.finish();
  for (const auto& companion : kCompanions) {
    if (reader.has(companion.key) && !reader.has(companion.action)) {
      reader.fail(companion.key, companion.reason);
    }
  }
}

Action read_power(TableReader& reader, std::size_t word) {
  const auto off = read_duration(reader, "off_s");
  if (off && word != 2) reader.fail("off_s", "belongs to power = \"cycle\"");
  if (word == 0) return PowerOn{};
  if (word == 1) return PowerOff{};
  PowerCycle cycle;
  if (off) cycle.off_for = *off;
  return cycle;
}

/// Reads an action on single drives; nullopt if the table has another one.
std::optional<Action> read_drive_action(TableReader& reader) {
  std::optional<Action> action;
  if (const auto word = reader.choice("power", {"on", "off", "cycle"})) {
    action = read_power(reader, *word);
  }
  if (const auto volts = reader.number("supply_V", 0, kHighestSupply_V)) {
    action = SupplyVoltage{*volts, read_duration(reader, "ramp_s").value_or(SimTime{0})};
  }
  if (const auto volts = reader.number("sag_to_V", 0, kHighestSupply_V)) {
    const auto lasts = read_duration(reader, "sag_s");
    if (!lasts) reader.note_missing("sag_s");
    action = Sag{*volts, lasts.value_or(SimTime{0})};
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

/// The body determines shaft and load of a drive with a joint.
void check_not_mounted(TableReader& reader, const ServoConfig* servo) {
  if (servo == nullptr || !servo->joint) return;
  for (const char* action : {"load", "turn_deg"}) {
    if (!reader.has(action)) continue;
    reader.fail(action, "drive " + std::to_string(servo->id) +
                            " turns a joint of the body: the body is its load");
  }
}

/// Makes one directive for each setting in the table.
std::vector<Action> read_settings(TableReader& reader, const ServoConfig& servo) {
  auto settings = *reader.table("settings");
  const protocol::Dialect& dialect = servo.quirks.dialect;
  Registers wanted = servo.rom;
  read_registers(settings, Presence::kOptional,
                 {.series = servo.profile.series,
                  .iq_limit_lsb = dialect.iq_command_limit_lsb,
                  .wide_gains = dialect.parameter_commands},
                 wanted);
  read_fields<Registers>(settings, profile_fields::kPlace, Presence::kOptional, wanted);
  settings.finish();
  std::vector<Action> actions;
  ServoConfig changed = servo;
  changed.rom = wanted;
  check_settings(reader, changed);
  for (std::size_t p = 0; p < kRomParameters; ++p) {
    const auto parameter = static_cast<RomParameter>(p);
    if (settings.has(rom_key(parameter))) actions.emplace_back(Setting{parameter, wanted});
  }
  if (actions.empty()) reader.fail("settings", "empty; give at least one setting");
  return actions;
}

const ServoConfig* find_servo(const BusConfig& bus, int id) {
  const auto found = std::ranges::find(bus.servos, id, &ServoConfig::id);
  return found != bus.servos.end() ? &*found : nullptr;
}

void check_id(TableReader& reader, const std::string& key, const BusConfig& bus, int id) {
  if (find_servo(bus, id) == nullptr) {
    reader.fail(key, "no drive " + std::to_string(id) + " on this bus");
  }
}

/// Returns the drives listed, or all of the bus.
std::vector<int> read_targets(TableReader& reader, const BusConfig& bus) {
  std::vector<int> ids = read_ids(reader);
  for (const int id : ids) check_id(reader, ids_key(reader), bus, id);
  if (ids.empty()) {
    for (const auto& servo : bus.servos) ids.push_back(servo.id);
  }
  return ids;
}

void refuse_ids(TableReader& reader, const char* action) {
  if (reader.has(ids_key(reader))) {
    reader.fail(ids_key(reader), std::string(action) + " acts on the whole bus; remove this key");
  }
}

std::optional<Action> read_bus_action(TableReader& reader, const BusConfig& bus,
                                      const std::vector<int>& ids) {
  std::optional<Action> action;
  if (reader.has("fault")) action = SetFault{read_fault(reader, bus, ids)};
  if (const auto which = reader.text("clear")) {
    refuse_ids(reader, "clear");
    action = ClearFault{*which};
  }
  if (auto act = read_body_act(reader, bus.body.get())) {
    refuse_ids(reader, "a body action");
    action = *act;
  }
  if (const auto text = reader.text("mark")) {
    refuse_ids(reader, "mark");
    const std::string problem = text_problem(*text, kLongestMark);
    if (!problem.empty()) reader.fail("mark", problem);
    action = Mark{*text};
  }
  return action;
}

}  // namespace

std::optional<SimTime> read_duration(TableReader& reader, const std::string& key) {
  const auto seconds = reader.number(key, 0, in_seconds(kLongestTime));
  return seconds ? std::optional(SimTime(protocol::rounded(*seconds * 1e9))) : std::nullopt;
}

std::vector<TimedDirective> read_directives(TableReader& reader, const BusConfig& bus,
                                            Timing timing) {
  const auto at = timing != Timing::kNow ? read_duration(reader, "at_s") : std::nullopt;
  const std::vector<int> ids = read_targets(reader, bus);
  const auto one = ids.size() == 1 ? std::optional(ids.front()) : std::nullopt;
  const auto when =
      timing != Timing::kNow ? read_condition(reader, bus, one) : std::optional<Condition>();
  if (!at && !when && timing == Timing::kRequired) reader.note_missing("at_s");
  check_actions(reader);
  std::vector<TimedDirective> directives;
  const auto add = [&](int id, Action action) {
    directives.push_back({at.value_or(SimTime{0}), {id, std::move(action)}, when});
  };
  if (const auto action = read_drive_action(reader)) {
    for (const int id : ids) {
      check_not_mounted(reader, find_servo(bus, id));
      add(id, *action);
    }
  } else if (reader.has("settings")) {
    for (const int id : ids) {
      for (Action& setting : read_settings(reader, *find_servo(bus, id))) {
        add(id, std::move(setting));
      }
    }
  } else if (auto whole = read_bus_action(reader, bus, ids)) {
    add(kWholeBus, std::move(*whole));
  }
  finish_event(reader);
  if (directives.empty()) {
    const char* const place = reader.has("at_s") ? "at_s" : reader.has("when") ? "when" : "";
    reader.fail(place, std::string("an event needs an action: ") + kActionList);
  }
  directives.front().source_json = reader.as_json({"at_s", "bus"});
  return directives;
}

std::optional<std::uint8_t> read_command(TableReader& reader, const std::string& key) {
  if (!reader.is_text(key)) {
    const auto number = reader.integer(key, 0, 255);
    return number ? std::optional(static_cast<std::uint8_t>(*number)) : std::nullopt;
  }
  const std::string text = *reader.text(key);
  unsigned value = 0;
  const char* const end = text.data() + text.size();
  const bool hex = text.starts_with("0x") || text.starts_with("0X");
  const auto [stop, error] =
      std::from_chars(text.data() + (hex ? 2 : 0), end, value, hex ? 16 : 10);
  if (error != std::errc() || stop != end || value > 255) {
    reader.fail(key, '"' + text + R"(" is not a command byte; write 0xA4 or "0xA4")");
  }
  return static_cast<std::uint8_t>(value);
}

std::optional<model::Error> read_error(TableReader& reader, const std::string& key) {
  std::vector<std::string> words;
  words.reserve(model::kErrorKinds);
  for (int n = 0; n < model::kErrorKinds; ++n) {
    words.emplace_back(error_word(static_cast<model::Error>(n)));
  }
  const auto word = reader.choice(key, words);
  return word ? std::optional(static_cast<model::Error>(*word)) : std::nullopt;
}

const Signal* read_signal(TableReader& reader, const std::string& key, const BusConfig& bus) {
  const auto name = reader.text(key);
  if (!name) return nullptr;
  const bool of_body = name->starts_with(kBodyPrefix);
  if (of_body && bus.body_signals == nullptr) reader.fail(key, "the robot has no [body]");
  std::vector<const Signal*> all = signals_with(bus.body_signals.get());
  // Suggests only names of the same kind.
  std::erase_if(all, [&](const Signal* one) { return one->is_of_body() != of_body; });
  std::vector<std::string> names;
  for (const Signal* const signal : all) names.emplace_back(signal->name);
  return all[*reader.choice(key, names)];
}

namespace {

SignalReaches read_level(TableReader& reader, const Signal* signal) {
  constexpr std::pair<const char*, Edge> kEdges[] = {
      {"above", Edge::kAbove}, {"below", Edge::kBelow}, {"crosses", Edge::kCrosses}};
  std::optional<SignalReaches> reaches;
  for (const auto& [word, edge] : kEdges) {
    const auto level = reader.number(word, -1e12, 1e12);
    if (!level) continue;
    if (reaches) reader.fail(word, "one of above, below and crosses is enough");
    reaches = SignalReaches{signal, edge, *level};
  }
  if (!reaches) reader.fail("signal", "needs one of above, below and crosses");
  return *reaches;
}

}  // namespace

std::optional<Condition> read_condition(TableReader& reader, const BusConfig& bus,
                                        std::optional<int> id) {
  auto when = reader.table("when");
  if (!when) return std::nullopt;
  Condition condition;
  const auto id_of_condition = when->integer("id", 1, protocol::kMaxId);
  if (id_of_condition) {
    id = static_cast<int>(*id_of_condition);
    check_id(*when, "id", bus, *id);
  }
  const Signal* const signal = read_signal(*when, "signal", bus);
  if (signal != nullptr && signal->is_of_body()) {
    if (id_of_condition) when->fail("id", "a body signal belongs to no drive; remove this key");
    id = bus.servos.front().id;  // any
  }
  const auto error = read_error(*when, "error");
  const auto command = read_command(*when, "command");
  const auto count = when->integer("count", 1, 1'000'000'000);
  if ((signal != nullptr) + error.has_value() + command.has_value() > 1) {
    when->fail("id", "one of signal, error and command is enough");
  }
  if (count && !command) when->fail("count", "belongs to command");
  if (signal != nullptr) {
    condition.what = read_level(*when, signal);
  } else if (error) {
    condition.what = ErrorSet{*error};
  } else if (command) {
    condition.what = CommandSeen{*command, static_cast<int>(count.value_or(1))};
  }
  when->finish();
  if (signal == nullptr && !error && !command) {
    reader.fail("when", "needs one of signal, error and command");
  }
  if (!id) reader.fail("when", "needs the id of a drive");
  condition.id = *id;
  return condition;
}

void read_events(TableReader& reader, BusConfig& bus) {
  std::vector<std::pair<TableReader, std::string>> clears;
  std::vector<std::pair<TableReader, const FaultRow*>> faults;
  bool delays = false;
  for (auto& event : reader.tables("event")) {
    for (TimedDirective& directive : read_directives(event, bus, Timing::kRequired)) {
      if (const auto* const clear = std::get_if<ClearFault>(&directive.directive.what)) {
        clears.emplace_back(event, clear->which);
      } else if (const auto* const set = std::get_if<SetFault>(&directive.directive.what)) {
        faults.emplace_back(event, set->fault.row);
        delays = delays || delays_in_adapter(*set->fault.row);
      }
      bus.events.push_back(std::move(directive));
    }
    check_room(event, bus.events);
  }
  std::ranges::stable_sort(bus.events, {}, &TimedDirective::at);
  for (const auto& [event, which] : clears) check_clear(event, which, bus.events);
  for (const auto& [event, row] : faults) check_adapter(event, *row, bus, delays);
}

}  // namespace lk::emulator
