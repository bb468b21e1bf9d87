#include "emulator/config/events/config_directives.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "emulator/config/config_checks.hpp"
#include "emulator/config/events/config_body_acts.hpp"
#include "emulator/config/profile.hpp"
#include "emulator/config/register_fields.hpp"
#include "emulator/config/rom_file.hpp"
#include "emulator/core/bus/bus.hpp"
#include "emulator/core/bus/host_adapter.hpp"
#include "emulator/core/faults/fault_table.hpp"
#include "emulator/core/text.hpp"
#include "protocol/rounding.hpp"

namespace lk::emulator {
namespace {

constexpr double kHighestSupply_V = 100;
constexpr std::size_t kLongestMark = 1000;
constexpr std::size_t kLongestName = 64;

const FaultRow& read_kind(TableReader& reader, const std::string& key) {
  std::vector<std::string> words;
  for (const FaultRow& row : fault_table()) words.emplace_back(row.word);
  const auto place = reader.choice(key, words);
  if (!place) {
    reader.note_missing(key);
    reader.finish();  // reports a misspelt key
    reader.fail(key, "missing");
  }
  return fault_table()[*place];
}

std::optional<FaultValue> read_value(TableReader& reader, const FaultParam& param) {
  const std::string word(param.word);
  if (!param.choices.empty()) {
    const auto place = reader.choice(word, {param.choices.begin(), param.choices.end()});
    return place ? std::optional<FaultValue>(static_cast<FaultChoice>(*place)) : std::nullopt;
  }
  if (!param.whole) {
    const auto number = reader.number(word, param.min, param.max);
    return number ? std::optional<FaultValue>(*number) : std::nullopt;
  }
  const auto whole = reader.integer(word, static_cast<std::int64_t>(param.min),
                                    static_cast<std::int64_t>(param.max));
  return whole ? std::optional<FaultValue>(static_cast<double>(*whole)) : std::nullopt;
}

void read_params(TableReader& reader, Fault& fault) {
  for (std::size_t n = 0; n < fault.values.size(); ++n) {
    const FaultParam& param = fault.row->params[n];
    if (param.word.empty()) return;
    if (const auto value = read_value(reader, param)) {
      fault.values[n] = *value;
    } else if (param.required) {
      reader.note_missing(std::string(param.word));
    }
  }
}

/// Reads for_s, every_s and times.
void read_course(TableReader& reader, Fault& fault) {
  const FaultRow& row = *fault.row;
  fault.duration = read_duration(reader, "for_s");
  fault.every = read_duration(reader, "every_s");
  const auto times = reader.integer("times", 1, 1'000'000'000);
  if (fault.duration && row.momentary()) {
    reader.fail("for_s", std::string(row.word) + " is instantaneous; remove this key");
  }
  if (fault.duration && *fault.duration == SimTime{0}) {
    reader.fail("for_s", "must be above 0; leave it out for a fault that stays");
  }
  if (times && !fault.every) reader.fail("times", "belongs to every_s");
  if (fault.every) {
    if (!fault.duration && !row.momentary()) {
      reader.fail("every_s", "needs for_s: how long it lasts each time");
    }
    if (*fault.every < kMinFaultPeriod) reader.fail("every_s", "must be at least 0.001");
    if (*fault.every <= fault.duration.value_or(SimTime{0})) {
      reader.fail("every_s", "must be longer than it lasts each time");
    }
    fault.times = static_cast<int>(times.value_or(0));
  }
}

/// Reads `fault`, a table or a word.
Fault read_fault(TableReader& reader, const BusConfig& bus, const std::vector<int>& ids) {
  Fault fault;
  if (reader.is_text("fault")) {  // fault = "hang"
    fault = fault_of(read_kind(reader, "fault"));
    for (const FaultParam& param : fault.row->params) {
      if (!param.required) continue;
      reader.fail("fault", "needs " + std::string(param.word) + ": { kind = \"" +
                               std::string(fault.row->word) + "\", " + std::string(param.word) +
                               " = … }");
    }
  } else {
    auto table = *reader.table("fault");
    fault = fault_of(read_kind(table, "kind"));
    fault.name = table.text("name").value_or("");
    read_params(table, fault);
    const auto probability = table.number("probability", 0, 1);
    if (probability && !fault.row->per_frame) {
      table.fail("probability", std::string(fault.row->word) + " does not act on frames");
    }
    fault.probability = probability.value_or(1);
    read_course(table, fault);
    table.finish();
    const std::string problem = text_problem(fault.name, kLongestName);
    if (!problem.empty()) table.fail("name", problem);
    if (fault.name == "all") table.fail("name", "\"all\" is reserved: it means all faults");
    if (fault.name == kPlanned)
      table.fail("name", "\"planned\" is reserved: it means all planned directives");
    const FaultRow* const other = find_fault(fault.name);
    if (other != nullptr && other != fault.row)
      table.fail("name", "is the name of another kind of fault");
  }
  const FaultRow& row = *fault.row;
  if (row.needs_one && fault.values == fault_of(row).values) {
    reader.fail("fault", std::string(row.word) + " needs " + std::string(row.params[0].word) +
                             " or " + std::string(row.params[1].word));
  }
  if (row.can && bus.serial) {
    reader.fail("fault", std::string(row.word) + " belongs to CAN, and this is an RS-485 bus");
  }
  if (row.serial && !bus.serial) {
    reader.fail("fault", std::string(row.word) + " belongs to RS-485, and this is a CAN bus");
  }
  if (row.of_bus) {
    const char* const key = reader.has("ids") ? "ids" : "id";
    if (reader.has(key)) {
      reader.fail(key, std::string(row.word) + " acts on the whole bus; remove this key");
    }
    return fault;
  }
  fault.ids = ids;
  // Rejects a fault that can have no effect on a drive, rather than ignore it.
  for (const ServoConfig& servo : bus.servos) {
    if (row.impossible == nullptr || std::ranges::find(ids, servo.id) == ids.end()) continue;
    const std::string why = row.impossible(fault, servo);
    if (!why.empty()) reader.fail("fault", std::string(row.word) + ": " + why);
  }
  return fault;
}

// --- actions

using Action = decltype(Directive::what);
using Actions = std::vector<Action>;

/// The bus of an event, and the IDs of its drives. `servo` is the drive of the directive; for an
/// action on the whole bus, the first drive of the bus.
struct Reading {
  const BusConfig& bus;
  const std::vector<int>& ids;
  const ServoConfig& servo;
  const Bus* running;
};

void read_power(TableReader& reader, const Reading& /*on*/, Actions& out) {
  const auto word = reader.choice("power", {"on", "off", "cycle"});
  const auto off = read_duration(reader, "off_s");
  if (off && word != 2U) reader.fail("off_s", "belongs to power = \"cycle\"");
  if (word == 0U) out.emplace_back(PowerOn{});
  if (word == 1U) out.emplace_back(PowerOff{});
  if (word == 2U) out.emplace_back(PowerCycle{off.value_or(PowerCycle{}.off_for)});
}

void read_supply(TableReader& reader, const Reading& /*on*/, Actions& out) {
  const auto volts = reader.number("supply_V", 0, kHighestSupply_V);
  out.emplace_back(SupplyVoltage{*volts, read_duration(reader, "ramp_s").value_or(SimTime{0})});
}

void read_sag(TableReader& reader, const Reading& /*on*/, Actions& out) {
  const auto volts = reader.number("sag_to_V", 0, kHighestSupply_V);
  out.emplace_back(Sag{*volts, reader.required("sag_s", read_duration(reader, "sag_s"))});
}

void read_ambient(TableReader& reader, const Reading& /*on*/, Actions& out) {
  out.emplace_back(AmbientTemperature{*reader.number("ambient_C", -40, 125)});
}

void read_drive_load(TableReader& reader, const Reading& /*on*/, Actions& out) {
  Load load;
  read_load(reader, load.load);
  out.emplace_back(load);
}

void read_turn(TableReader& reader, const Reading& /*on*/, Actions& out) {
  out.emplace_back(TurnShaft{*reader.number("turn_deg", -1e6, 1e6)});
}

/// Makes one directive for each setting in the table.
void read_settings(TableReader& reader, const Reading& on, Actions& out) {
  auto settings = *reader.table("settings");
  const protocol::Dialect& dialect = on.servo.quirks.dialect;
  Registers wanted = on.running != nullptr ? on.running->servo(on.servo.id).ram : on.servo.rom;
  read_registers(settings, Presence::kOptional,
                 {.series = on.servo.profile.series,
                  .iq_limit_lsb = dialect.iq_command_limit_lsb,
                  .wide_gains = dialect.parameter_commands},
                 wanted);
  read_fields<Registers>(settings, profile_fields::kPlace, Presence::kOptional, wanted);
  settings.finish();
  check_settings(reader, on.servo.profile.drive, wanted);
  for (std::size_t p = 0; p < kRomParameters; ++p) {
    const auto parameter = static_cast<RomParameter>(p);
    if (settings.has(rom_key(parameter))) out.emplace_back(Setting{parameter, wanted});
  }
  if (out.empty()) reader.fail("settings", "empty; give at least one setting");
}

void read_set_fault(TableReader& reader, const Reading& on, Actions& out) {
  out.emplace_back(SetFault{read_fault(reader, on.bus, on.ids)});
}

void read_clear(TableReader& reader, const Reading& /*on*/, Actions& out) {
  out.emplace_back(ClearFault{*reader.text("clear")});
}

void read_mark(TableReader& reader, const Reading& /*on*/, Actions& out) {
  const auto text = reader.text("mark");
  const std::string problem = text_problem(*text, kLongestMark);
  if (!problem.empty()) reader.fail("mark", problem);
  out.emplace_back(Mark{*text});
}

template <BodyAct (*kRead)(TableReader& reader, const Mechanism& body)>
void read_body_act(TableReader& reader, const Reading& on, Actions& out) {
  out.emplace_back(kRead(reader, *on.bus.body));
}

/// An action: its key, its target and its reader.
struct ActionRow {
  enum class Target : std::uint8_t {
    kDrives,
    kFreeDrives,  // drives without a joint; of others, the body is the load
    kFault,       // drives or the whole bus, by the kind of fault
    kBus,         // the whole bus; `id` and `ids` are rejected
    kBody         // the body; `id` and `ids` are rejected
  };
  const char* key;
  Target target;
  void (*read)(TableReader& reader, const Reading& on, Actions& out);
};
using Target = ActionRow::Target;
constexpr ActionRow kActions[] = {
    {"power", Target::kDrives, &read_power},
    {"supply_V", Target::kDrives, &read_supply},
    {"sag_to_V", Target::kDrives, &read_sag},
    {"ambient_C", Target::kDrives, &read_ambient},
    {"load", Target::kFreeDrives, &read_drive_load},
    {"turn_deg", Target::kFreeDrives, &read_turn},
    {"settings", Target::kDrives, &read_settings},
    {"fault", Target::kFault, &read_set_fault},
    {"clear", Target::kBus, &read_clear},
    {"push", Target::kBody, &read_body_act<&read_push>},
    {"payload", Target::kBody, &read_body_act<&read_payload>},
    {"freeze", Target::kBody, &read_body_act<&read_freeze>},
    {"floor", Target::kBody, &read_body_act<&read_floor>},
    {"pose", Target::kBody, &read_body_act<&read_pose>},
    {"mark", Target::kBus, &read_mark},
};

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

/// Returns the only action of the event; null if it has none.
const ActionRow* find_action(TableReader& reader) {
  if (reader.has("clock")) {
    reader.fail("clock", "time is the running program's: --clock, or lk-emu ctl clock");
  }
  const ActionRow* found = nullptr;
  for (const ActionRow& row : kActions) {
    if (!reader.has(row.key)) {
      reader.table(row.key);  // makes the key known, so that `finish` can suggest it
    } else if (found != nullptr) {
      reader.fail(row.key, std::string("only one action per event; this event has ") + found->key +
                               " already");
    } else {
      found = &row;
    }
  }
  return found;
}

/// Rejects unknown keys first, so that a misspelt action is reported as such; then keys that belong
/// to another action.
void finish_event(TableReader& reader) {
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

/// Returns "power, supply_V … or mark".
std::string action_list() {
  std::vector<std::string> words;
  for (const ActionRow& row : kActions) words.emplace_back(row.key);
  const std::string last = words.back();
  words.pop_back();
  return comma_list(words) + " or " + last;
}

void check_target(const TableReader& reader, const ActionRow& row, const Reading& on) {
  if (row.target == Target::kFreeDrives && on.servo.joint) {
    reader.fail(row.key, "drive " + std::to_string(on.servo.id) +
                             " turns a joint of the body: the body is its load");
  }
  if (row.target == Target::kBody && on.bus.body == nullptr) {
    reader.fail(row.key, "the robot has no [body]");
  }
}

}  // namespace

bool delays_in_adapter(const FaultRow& row) {
  return row.adapter_shows == &AdapterEffects::late ||
         row.adapter_shows == &AdapterEffects::batched;
}

void check_adapter(const TableReader& event, const Fault& fault, const BusConfig& bus,
                   bool others_delay) {
  constexpr std::size_t kTxDepth = 2;  // parameter of adapter_overrun
  const FaultRow& row = *fault.row;
  if (row.adapter_shows != &AdapterEffects::lost || bus.adapter != nullptr || others_delay) return;
  if (fault.values[kTxDepth].number() > 0) return;
  event.fail("fault", std::string(row.word) +
                          ": this bus has no adapter that delays frames; give the bus an "
                          "`adapter`, or add adapter_latency or adapter_batch first");
}

const ServoConfig* find_servo(const BusConfig& bus, int id) {
  const auto found = std::ranges::find(bus.servos, id, &ServoConfig::id);
  return found != bus.servos.end() ? &*found : nullptr;
}

void check_id(const TableReader& reader, const std::string& key, const BusConfig& bus, int id) {
  if (find_servo(bus, id) == nullptr) {
    reader.fail(key, "no drive " + std::to_string(id) + " on this bus");
  }
}

std::vector<int> read_targets(TableReader& reader, const BusConfig& bus) {
  std::vector<int> ids = read_ids(reader);
  for (const int id : ids) check_id(reader, ids_key(reader), bus, id);
  if (ids.empty()) {
    for (const auto& servo : bus.servos) ids.push_back(servo.id);
  }
  return ids;
}

std::optional<SimTime> read_duration(TableReader& reader, const std::string& key) {
  const auto seconds = reader.number(key, 0, in_seconds(kLongestTime));
  return seconds ? std::optional(SimTime(protocol::rounded(*seconds * 1e9))) : std::nullopt;
}

std::string text_problem(const std::string& text, std::size_t longest) {
  if (text.size() > longest) return "is longer than " + std::to_string(longest) + " bytes";
  return sanitized_line(text) == text ? "" : "must be one line without control characters";
}

std::vector<TimedDirective> read_directives(TableReader& reader, const BusConfig& bus,
                                            Timing timing, const Bus* running) {
  const auto at = timing != Timing::kNow ? read_duration(reader, "at_s") : std::nullopt;
  const std::vector<int> ids = read_targets(reader, bus);
  const auto one = ids.size() == 1 ? std::optional(ids.front()) : std::nullopt;
  const auto when =
      timing != Timing::kNow ? read_condition(reader, bus, one) : std::optional<Condition>();
  if (!at && !when && timing == Timing::kRequired) reader.note_missing("at_s");
  std::vector<TimedDirective> directives;
  if (const ActionRow* const row = find_action(reader)) {
    const bool each = row->target == Target::kDrives || row->target == Target::kFreeDrives;
    for (const int id : each ? ids : std::vector{kWholeBus}) {
      const Reading on{bus, ids, each ? *find_servo(bus, id) : bus.servos.front(), running};
      check_target(reader, *row, on);
      Actions actions;
      row->read(reader, on, actions);
      for (Action& action : actions) {
        directives.push_back({at.value_or(SimTime{0}), {id, std::move(action)}, when});
      }
    }
    if (!each && row->target != Target::kFault && reader.has(ids_key(reader))) {
      const std::string what = row->target == Target::kBody ? "a body action" : row->key;
      reader.fail(ids_key(reader), what + " acts on the whole bus; remove this key");
    }
  }
  finish_event(reader);
  if (directives.empty()) {
    const char* const place = reader.has("at_s") ? "at_s" : reader.has("when") ? "when" : "";
    reader.fail(place, "an event needs an action: " + action_list());
  }
  directives.front().source_json = reader.as_json({"at_s", "bus"});
  return directives;
}

}  // namespace lk::emulator
