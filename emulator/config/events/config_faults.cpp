#include <algorithm>

#include "emulator/config/events/config_directives.hpp"
#include "emulator/core/bus/bus.hpp"
#include "emulator/core/faults/fault_table.hpp"
#include "emulator/core/text.hpp"
#include "emulator/core/wire/host_adapter.hpp"

namespace lk::emulator {
namespace {

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

}  // namespace

void check_room(const TableReader& event, const std::vector<TimedDirective>& directives) {
  const auto faults = std::ranges::count_if(directives, [](const TimedDirective& one) {
    return std::holds_alternative<SetFault>(one.directive.what);
  });
  const auto waiting = std::ranges::count_if(
      directives, [](const TimedDirective& one) { return one.when.has_value(); });
  const auto refuse = [&](const char* key, const char* what, std::size_t most) {
    event.fail(key, "a bus keeps " + std::to_string(most) + " " + what);
  };
  if (static_cast<std::size_t>(faults) > Bus::kMaxFaults) {
    refuse("fault", "faults", Bus::kMaxFaults);
  }
  if (static_cast<std::size_t>(waiting) > Bus::kMaxWaiting) {
    refuse("when", "conditions", Bus::kMaxWaiting);
  }
}

std::string text_problem(const std::string& text, std::size_t longest) {
  if (text.size() > longest) return "is longer than " + std::to_string(longest) + " bytes";
  return sanitized_line(text) == text ? "" : "must be one line without control characters";
}

void check_clear(const TableReader& reader, const std::string& which,
                 const std::vector<TimedDirective>& directives) {
  std::vector<std::string> names;  // as they will be on the bus
  std::vector<std::string> known = {"all", std::string(kPlanned)};
  for (const TimedDirective& directive : directives) {
    const auto* const set = std::get_if<SetFault>(&directive.directive.what);
    if (set == nullptr) continue;
    const std::string kind(set->fault.row->word);
    const std::string wanted = set->fault.name.empty() ? kind : set->fault.name;
    std::string name = wanted;
    const auto taken = [&] { return std::ranges::find(names, name) != names.end(); };
    for (int n = 2; taken(); ++n) name = wanted + "-" + std::to_string(n);
    names.push_back(name);
    known.insert(known.end(), {name, kind});
  }
  if (std::ranges::find(known, which) != known.end()) return;
  const std::string meant = closest_match(which, known);
  reader.fail("clear", "no fault has the name or kind \"" + which + "\"" +
                           (meant.empty() ? "" : "; did you mean " + meant + "?"));
}

bool delays_in_adapter(const FaultRow& row) {
  return row.adapter_shows == &AdapterEffects::late ||
         row.adapter_shows == &AdapterEffects::batched;
}

void check_adapter(const TableReader& event, const FaultRow& row, const BusConfig& bus,
                   bool others_delay) {
  if (row.adapter_shows != &AdapterEffects::lost || bus.adapter != nullptr || others_delay) return;
  event.fail("fault", std::string(row.word) +
                          ": this bus has no adapter that delays frames; give the bus an "
                          "`adapter`, or add adapter_latency or adapter_batch first");
}

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

}  // namespace lk::emulator
