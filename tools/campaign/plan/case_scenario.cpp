#include "tools/campaign/plan/case_scenario.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "emulator/config/events/config_directives.hpp"
#include "emulator/config/profile_fields.hpp"
#include "emulator/config/scenario/config_scenario.hpp"
#include "emulator/core/faults/fault_table.hpp"
#include "tools/cases/toml_text.hpp"

namespace lk::emulator {
namespace {

constexpr const char* kHostRulePrefix = "a host notices: ";
constexpr const char* kDrivePrefix = "a drive notices";

void insert_number(toml::table& table, const std::string& key, double value) {
  if (value == std::round(value) && std::abs(value) < 0x1p53) {
    table.insert_or_assign(key, static_cast<std::int64_t>(value));
  } else {
    table.insert_or_assign(key, value);
  }
}

void insert_value(toml::table& table, const std::string& key, const CaseValue& value) {
  if (const auto* word = std::get_if<std::string>(&value)) {
    table.insert_or_assign(key, *word);
  } else {
    insert_number(table, key, std::get<double>(value));
  }
}

bool of_fault(Target target) {
  return target == Target::kFaultKind || target == Target::kFaultBus ||
         target == Target::kFaultId || target == Target::kFaultAt || target == Target::kFaultFor ||
         target == Target::kFaultProbability || target == Target::kFaultParam;
}

toml::array& array_of(toml::table& document, const char* key) {
  if (!document.contains(key)) document.insert(key, toml::array{});
  return *document[key].as_array();
}

/// The drive's load as it is, with one of its numbers changed.
toml::table load_table(const model::LoadParams& load) {
  toml::table table;
  table.is_inline(true);
  for (const auto& field : profile_fields::kLoad) {
    const auto member = std::get<double model::LoadParams::*>(field.member);
    const double value = load.*member / field.unit;
    // An end stop that is not there has no number in a file.
    if (value < field.min || value > field.max) continue;
    insert_number(table, field.key, std::round(value * 1e9) / 1e9);
  }
  return table;
}

/// Frames that win every arbitration take this share of the wire.
toml::table background(const BusConfig& bus, double share) {
  constexpr double kBitsOfAFrame = 111 + 19 / 2.0;  // 8 bytes, and about half of the stuff bits
  toml::table send;
  send.insert("bus", bus.interface);
  send.insert("at_s", 0);
  send.insert("frame", "001#5555555555555555");
  const double bitrate = static_cast<double>(bus.bitrate);
  send.insert("every_s", std::max(std::round(kBitsOfAFrame / bitrate / share * 1e7) / 1e7, 1e-5));
  return send;
}

/// The path of what the base names, from wherever the case's file will stand.
void make_absolute(toml::table& table, const char* key, const std::filesystem::path& directory,
                   bool names_too) {
  const auto given = table[key].value<std::string>();
  if (!given || (!names_too && !is_path(*given))) return;
  table.insert_or_assign(key, std::filesystem::absolute(directory / *given).string());
}

}  // namespace

CaseScenarios::CaseScenarios(const Plan& plan)
    : plan_(plan),
      files_(plan.scenario_file.parent_path()),
      base_(parse_toml(plan.scenario_text, plan.scenario_file.string())) {}

std::string CaseScenarios::group_key(const CaseValues& values) const {
  CaseValues rest = without_fault(values);
  for (std::size_t n = 0; n < rest.size(); ++n) {
    if (plan_.dimensions[n].target == Target::kHost) rest[n].reset();
  }
  return key_of(rest);
}

void CaseScenarios::vary_surroundings(const CaseValues& values, const Scenario& plain,
                                      toml::array& events) {
  std::vector<toml::table> more;
  for (const BusConfig& bus : plain.robot) {
    for (const ServoConfig& servo : bus.servos) {
      toml::table load = load_table(servo.profile.drive.load);
      bool loaded = false;
      for (std::size_t n = 0; n < values.size(); ++n) {
        const Dimension& dimension = plan_.dimensions[n];
        if (!values[n]) continue;
        toml::table event;
        event.insert("at_s", 0);
        event.insert("bus", bus.interface);
        event.insert("id", servo.id);
        if (dimension.target == Target::kSupply) insert_value(event, "supply_V", *values[n]);
        if (dimension.target == Target::kAmbient) insert_value(event, "ambient_C", *values[n]);
        if (event.size() > 3) more.push_back(std::move(event));
        if (dimension.target != Target::kLoad) continue;
        insert_value(load, dimension.key, *values[n]);
        loaded = true;
      }
      if (!loaded) continue;
      toml::table event;
      event.insert("at_s", 0);
      event.insert("bus", bus.interface);
      event.insert("id", servo.id);
      event.insert("load", load);
      more.push_back(std::move(event));
    }
  }
  // Before what the scenario itself does at 0.
  events.insert(events.cbegin(), more.begin(), more.end());
}

toml::table CaseScenarios::document(const CaseValues& values, bool watched) {
  toml::table document = base_;
  bool surroundings = false;
  double bus_load = 0;
  for (std::size_t n = 0; n < values.size(); ++n) {
    if (!values[n]) continue;
    const Dimension& dimension = plan_.dimensions[n];
    const Target target = dimension.target;
    if (target == Target::kSeed || target == Target::kBitrate || target == Target::kGeneration) {
      insert_value(document, dimension.name, *values[n]);
    }
    surroundings = surroundings || target == Target::kSupply || target == Target::kAmbient ||
                   target == Target::kLoad;
    if (target == Target::kBusLoad) bus_load = std::get<double>(*values[n]);
  }
  if (!surroundings && bus_load == 0 && !watched) return document;
  const Scenario plain = parse_scenario(toml_text(document), plan_.scenario_file.string(),
                                        std::nullopt, files_.files());
  if (surroundings) vary_surroundings(values, plain, array_of(document, "event"));
  bool can_be_loaded = false;
  for (const BusConfig& bus : plain.robot) {
    if (bus_load == 0 || bus.bitrate == 0 || bus.serial) continue;
    array_of(document, "send").push_back(background(bus, bus_load));
    can_be_loaded = true;
  }
  if (bus_load > 0 && !can_be_loaded) {
    throw ConfigError(plan_.file.string(), 0, "bus_load",
                      "needs a CAN bus with a bitrate, which frames take time on");
  }
  if (!watched) return document;
  toml::array& expectations = array_of(document, "expect");
  for (const BusConfig& bus : plain.robot) {
    for (const ServoConfig& servo : bus.servos) {
      std::vector<std::string> errors = plan_.detection.drive_errors;
      if (errors.empty()) errors.emplace_back("any");
      for (const std::string& error : errors) {
        if (!plan_.detection.by_drive) break;
        toml::table expect;
        expect.insert("says", kDrivePrefix);
        expect.insert("bus", bus.interface);
        expect.insert("id", servo.id);
        expect.insert("error", error);
        expect.insert("by_s", std::chrono::duration<double>(plain.duration).count());
        expectations.push_back(std::move(expect));
      }
    }
  }
  for (const HostRule& rule : plan_.detection.host) {
    toml::table expect = parse_toml(rule.toml, plan_.file.string());
    expect.insert("says", kHostRulePrefix + rule.text);
    expectations.push_back(std::move(expect));
  }
  return document;
}

CaseGroup CaseScenarios::group(const CaseValues& values) {
  CaseGroup group;
  group.scenario = parse_scenario(toml_text(document(values, true)), plan_.scenario_file.string(),
                                  std::nullopt, files_.files());
  const std::vector<Expectation>& all = group.scenario.expectations;
  for (const Expectation& one : all) {
    if (one.says == kDrivePrefix) {
      ++group.watched.drive;
    } else if (one.says.starts_with(kHostRulePrefix)) {
      ++group.watched.host;
      group.fires_by_failing.push_back(std::holds_alternative<Answered>(one.what));
    } else {
      ++group.watched.own;
      group.hazardous.push_back(plan_.hazards.empty() ||
                                std::ranges::find(plan_.hazards, one.says) != plan_.hazards.end());
    }
  }
  std::vector<std::size_t> by_bus(all.size());
  std::iota(by_bus.begin(), by_bus.end(), std::size_t{0});
  std::ranges::stable_sort(by_bus, {}, [&](std::size_t n) { return all[n].bus; });
  group.order.resize(all.size());
  for (std::size_t n = 0; n < all.size(); ++n) group.order[by_bus[n]] = n;
  return group;
}

toml::table CaseScenarios::fault_event(const CaseValues& values) const {
  toml::table event;
  toml::table fault;
  fault.is_inline(true);
  for (std::size_t n = 0; n < values.size(); ++n) {
    if (!values[n]) continue;
    const Dimension& dimension = plan_.dimensions[n];
    if (dimension.target == Target::kFaultAt) insert_value(event, "at_s", *values[n]);
    if (dimension.target == Target::kFaultBus) insert_value(event, "bus", *values[n]);
    if (dimension.target == Target::kFaultId) insert_value(event, "id", *values[n]);
    if (dimension.target == Target::kFaultKind) insert_value(fault, "kind", *values[n]);
    if (dimension.target == Target::kFaultFor) insert_value(fault, "for_s", *values[n]);
    if (dimension.target == Target::kFaultProbability) {
      insert_value(fault, "probability", *values[n]);
    }
    if (dimension.target == Target::kFaultParam) insert_value(fault, dimension.key, *values[n]);
  }
  event.insert("fault", fault);
  return event;
}

std::vector<PlannedDirective> CaseScenarios::fault(const CaseValues& values,
                                                   const Scenario& scenario) const {
  if (kind_of(plan_, values) == nullptr) return {};
  const toml::table event = fault_event(values);
  TableReader reader(event, plan_.file.string(), "fault");
  std::optional<int> id;
  if (const auto given = event["id"].value<std::int64_t>()) id = static_cast<int>(*given);
  const std::size_t bus = scenario.robot.size() == 1 ? 0 : read_bus_of(reader, scenario.robot, id);
  read_moment(reader, "at_s", scenario.duration);
  std::vector<PlannedDirective> planned;
  for (TimedDirective& one : read_directives(reader, scenario.robot[bus], Timing::kRequired)) {
    planned.push_back({bus, std::move(one)});
  }
  return planned;
}

CaseScenarios::Keys CaseScenarios::keys(const CaseValues& values) {
  toml::table whole = document(values, false);
  make_absolute(whole, "robot", plan_.scenario_file.parent_path(), false);
  Keys keys;
  keys.robot = whole["robot"].value_or("");
  keys.generation = whole["generation"].value<std::string>();
  keys.bitrate = whole["bitrate"].value<std::int64_t>();
  if (const auto seed = whole["seed"].value<std::int64_t>()) {
    keys.seed = static_cast<std::uint64_t>(*seed);
  }
  return keys;
}

CaseValues CaseScenarios::without_fault(const CaseValues& values) const {
  CaseValues rest = values;
  for (std::size_t n = 0; n < rest.size(); ++n) {
    if (of_fault(plan_.dimensions[n].target)) rest[n].reset();
  }
  return rest;
}

std::string CaseScenarios::file_text(const CaseValues& values, bool watched) {
  toml::table whole = document(values, watched);
  const std::filesystem::path directory = plan_.scenario_file.parent_path();
  make_absolute(whole, "robot", directory, false);
  if (auto* sends = whole["send"].as_array()) {
    for (toml::node& send : *sends) make_absolute(*send.as_table(), "play", directory, true);
  }
  if (kind_of(plan_, values) != nullptr) {
    array_of(whole, "event").push_back(fault_event(values));
  }
  return toml_text(whole);
}

}  // namespace lk::emulator
