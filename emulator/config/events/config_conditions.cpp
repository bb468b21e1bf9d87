// Reads conditions, and the events of a bus as a whole.

#include <algorithm>
#include <utility>

#include "emulator/config/events/config_directives.hpp"
#include "emulator/core/bus/bus.hpp"
#include "emulator/core/faults/fault_table.hpp"
#include "emulator/core/servo/signals.hpp"
#include "emulator/core/text.hpp"

namespace lk::emulator {

std::optional<std::uint8_t> read_command(TableReader& reader, const std::string& key) {
  if (!reader.is_text(key)) {
    const auto number = reader.integer(key, 0, 255);
    return number ? std::optional(static_cast<std::uint8_t>(*number)) : std::nullopt;
  }
  const std::string text = *reader.text(key);
  const bool hex = text.starts_with("0x") || text.starts_with("0X");
  const auto byte = number_of(text.substr(hex ? 2 : 0), hex ? 16 : 10, 255);
  if (!byte) reader.fail(key, '"' + text + R"(" is not a command byte; write 0xA4 or "0xA4")");
  return static_cast<std::uint8_t>(*byte);
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
  // Keeps only signals of the same kind, body or drive, to suggest.
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
    id = bus.servos.front().id;  // any drive: the signal belongs to none
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

void check_clear(const TableReader& reader, const std::string& which,
                 const std::vector<TimedDirective>& directives) {
  std::vector<std::string> names;  // names that the faults get on the bus
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

void read_events(TableReader& reader, BusConfig& bus) {
  std::vector<std::pair<TableReader, std::string>> clears;
  std::vector<std::pair<TableReader, Fault>> faults;
  bool delays = false;
  for (auto& event : reader.tables("event")) {
    for (TimedDirective& directive : read_directives(event, bus, Timing::kRequired)) {
      if (const auto* const clear = std::get_if<ClearFault>(&directive.directive.what)) {
        clears.emplace_back(event, clear->which);
      } else if (const auto* const set = std::get_if<SetFault>(&directive.directive.what)) {
        faults.emplace_back(event, set->fault);
        delays = delays || delays_in_adapter(*set->fault.row);
      }
      bus.events.push_back(std::move(directive));
    }
    check_room(event, bus.events);
  }
  std::ranges::stable_sort(bus.events, {}, &TimedDirective::at);
  for (const auto& [event, which] : clears) check_clear(event, which, bus.events);
  for (const auto& [event, fault] : faults) check_adapter(event, fault, bus, delays);
}

}  // namespace lk::emulator
