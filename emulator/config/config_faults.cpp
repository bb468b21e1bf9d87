#include <algorithm>
#include <iterator>
#include <sstream>

#include "emulator/config/config_directives.hpp"
#include "emulator/core/bus.hpp"
#include "emulator/core/fault_table.hpp"
#include "emulator/ground/text.hpp"

namespace lk::emulator {
namespace {

constexpr std::size_t kLongestName = 64;

std::vector<std::string> words_of(std::string_view text) {
  std::istringstream stream{std::string(text)};
  return {std::istream_iterator<std::string>(stream), {}};
}

const FaultRow& read_kind(TableReader& reader, const std::string& key) {
  std::vector<std::string> words;
  for (const FaultRow& row : fault_table()) words.emplace_back(row.word);
  const auto place = reader.choice(key, words);
  if (!place) {
    reader.note_missing(key);
    reader.finish();  // calls a misspelt one so
    reader.fail(key, "missing");
  }
  return fault_table()[*place];
}

/// What is counted, and takes no fractions.
bool is_whole(std::string_view word) {
  return word == "bits" || word == "copies" || word == "dlc" || word == "offset" ||
         word == "can_id";
}

std::optional<double> read_value(TableReader& reader, const std::string& word,
                                 const FaultParam& param) {
  if (!is_whole(word)) return reader.number(word, param.min, param.max);
  const auto whole = reader.integer(word, static_cast<std::int64_t>(param.min),
                                    static_cast<std::int64_t>(param.max));
  return whole ? std::optional(static_cast<double>(*whole)) : std::nullopt;
}

void read_params(TableReader& reader, const FaultRow& row, Fault& fault) {
  for (std::size_t n = 0; n < row.params.size() && !row.params[n].word.empty(); ++n) {
    const FaultParam& param = row.params[n];
    const std::string word(param.word);
    fault.values[n] = param.fallback;
    if (!param.choices.empty()) {
      if (const auto place = reader.choice(word, words_of(param.choices))) {
        fault.values[n] = static_cast<double>(*place);
      }
    } else if (const auto value = read_value(reader, word, param)) {
      fault.values[n] = *value;
    } else if (param.required) {
      reader.note_missing(word);
    }
  }
}

/// Beginnings closer than this are no faults one after the other, and a run would be busy with
/// nothing else.
constexpr SimTime kClosest = std::chrono::milliseconds(1);

/// for_s, every_s, times.
void read_course(TableReader& reader, const FaultRow& row, Fault& fault) {
  fault.duration = read_duration(reader, "for_s");
  fault.every = read_duration(reader, "every_s");
  const auto times = reader.integer("times", 1, 1'000'000'000);
  if (fault.duration && row.momentary) {
    reader.fail("for_s", std::string(row.word) + " is done at once and takes no time");
  }
  if (fault.duration && *fault.duration == SimTime{0}) {
    reader.fail("for_s", "must be above 0; leave it out for a fault that stays");
  }
  if (times && !fault.every) reader.fail("times", "belongs to every_s");
  if (fault.every) {
    if (!fault.duration && !row.momentary) {
      reader.fail("every_s", "needs for_s: how long it lasts each time");
    }
    if (*fault.every < kClosest) reader.fail("every_s", "must be at least 0.001");
    if (*fault.every <= fault.duration.value_or(SimTime{0})) {
      reader.fail("every_s", "must be longer than it lasts each time");
    }
    fault.times = static_cast<int>(times.value_or(0));
  }
}

/// A fault that cannot do anything to the drive is refused instead of accepted and forgotten.
std::string impossible(const Fault& fault, const ServoConfig& servo) {
  const FaultKind kind = fault.kind;
  const std::string drive = "drive " + std::to_string(servo.id);
  const bool of_current_sensor =
      kind >= FaultKind::kCurrentOffset && kind <= FaultKind::kCurrentStuck;
  if (of_current_sensor && servo.profile.series == Series::kMs) {
    return drive + " has no current sensors (MS series)";
  }
  const model::MechanicsParams& gear = servo.profile.drive.mechanics;
  if (kind == FaultKind::kBacklash && (gear.backlash_out <= 0 || gear.gear_stiffness_out <= 0)) {
    return drive + " has no gear with play";
  }
  if (kind == FaultKind::kRamFlipped) {
    const bool ms = servo.profile.series == Series::kMs;
    const auto parameter = static_cast<RomParameter>(fault.values[0]);
    if (parameter == (ms ? RomParameter::kMaxTorqueCurrent : RomParameter::kMaxPower)) {
      return drive + " is limited by " + (ms ? "max_power" : "max_torque_current") +
             ", not by this parameter";
    }
  }
  return "";
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
  if (static_cast<std::size_t>(faults) > Bus::kMostFaults) {
    refuse("fault", "faults", Bus::kMostFaults);
  }
  if (static_cast<std::size_t>(waiting) > Bus::kMostWaiting) {
    refuse("when", "conditions", Bus::kMostWaiting);
  }
}

std::string text_problem(const std::string& text, std::size_t longest) {
  if (text.size() > longest) return "is longer than " + std::to_string(longest) + " bytes";
  return on_one_line(text) == text ? "" : "must be one line without control characters";
}

void check_clear(const TableReader& reader, const std::string& which,
                 const std::vector<TimedDirective>& directives) {
  std::vector<std::string> names;  // that they will have on the bus
  std::vector<std::string> known = {"all", std::string(kPlanned)};
  for (const TimedDirective& directive : directives) {
    const auto* const set = std::get_if<SetFault>(&directive.directive.what);
    if (set == nullptr) continue;
    const std::string kind(fault_row(set->fault.kind).word);
    const std::string wanted = set->fault.name.empty() ? kind : set->fault.name;
    std::string name = wanted;
    const auto taken = [&] { return std::ranges::find(names, name) != names.end(); };
    for (int n = 2; taken(); ++n) name = wanted + "-" + std::to_string(n);
    names.push_back(name);
    known.insert(known.end(), {name, kind});
  }
  if (std::ranges::find(known, which) != known.end()) return;
  const std::string meant = nearest(which, known);
  reader.fail("clear", "no fault is called \"" + which + "\", and none is of that kind" +
                           (meant.empty() ? "" : "; did you mean " + meant + "?"));
}

Fault read_fault(TableReader& reader, const BusConfig& bus, const std::vector<int>& ids) {
  Fault fault;
  if (reader.is_text("fault")) {  // fault = "hang"
    const FaultRow& row = read_kind(reader, "fault");
    fault.kind = row.kind;
    for (std::size_t n = 0; n < row.params.size(); ++n) {
      if (row.params[n].required) {
        reader.fail("fault", "needs " + std::string(row.params[n].word) + ": { kind = \"" +
                                 std::string(row.word) + "\", " + std::string(row.params[n].word) +
                                 " = … }");
      }
      fault.values[n] = row.params[n].fallback;
    }
  } else {
    auto table = *reader.table("fault");
    const FaultRow& row = read_kind(table, "kind");
    fault.kind = row.kind;
    fault.name = table.text("name").value_or("");
    read_params(table, row, fault);
    const auto probability = table.number("probability", 0, 1);
    if (probability && !row.per_frame) {
      table.fail("probability", std::string(row.word) + " does not act on frames");
    }
    fault.probability = probability.value_or(1);
    read_course(table, row, fault);
    table.finish();
    const std::string problem = text_problem(fault.name, kLongestName);
    if (!problem.empty()) table.fail("name", problem);
    if (fault.name == "all") table.fail("name", "\"all\" means all faults");
    if (fault.name == kPlanned) table.fail("name", "\"planned\" means what is planned");
    const FaultRow* const other = find_fault(fault.name);
    if (other != nullptr && other != &row) table.fail("name", "is the word for another kind");
  }
  const FaultRow& row = fault_row(fault.kind);
  if (fault.kind == FaultKind::kEndStop && fault.values[0] == row.params[0].fallback &&
      fault.values[1] == row.params[1].fallback) {
    reader.fail("fault", "end_stop needs min_deg or max_deg");
  }
  if (row.of_bus) {
    const char* const key = reader.has("ids") ? "ids" : "id";
    if (reader.has(key)) {
      reader.fail(key, std::string(row.word) + " is of the bus as a whole");
    }
    return fault;
  }
  fault.ids = ids;
  for (const ServoConfig& servo : bus.servos) {
    if (std::ranges::find(ids, servo.id) == ids.end()) continue;
    const std::string why = impossible(fault, servo);
    if (!why.empty()) reader.fail("fault", std::string(row.word) + ": " + why);
  }
  return fault;
}

}  // namespace lk::emulator
