#include "tools/cases/case_builder.hpp"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <numeric>
#include <sstream>
#include <string_view>
#include <utility>

#include "emulator/config/events/config_directives.hpp"
#include "emulator/config/profile_fields.hpp"
#include "emulator/config/scenario/config_scenario.hpp"
#include "emulator/files/output_file.hpp"
#include "emulator/files/profile_files.hpp"

namespace lk::emulator {
namespace {

std::string leaf_text(const toml::node& node) {
  std::ostringstream text;
  text << toml::toml_formatter{node, toml::format_flags::none};  // none: strings in "", on one line
  return text.str();
}

std::string key_text(std::string_view key) {
  const bool bare = !key.empty() && std::ranges::all_of(key, [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-';
  });
  return bare ? std::string(key) : leaf_text(toml::value<std::string>(key));
}

std::string float_text(double value) {
  char buffer[32];
  std::string text(buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr);
  // TOML reads a number without a point as an integer.
  const bool whole = text.find_first_not_of("-0123456789") == std::string::npos;
  return whole ? text + ".0" : text;
}

std::string node_text(const toml::node& node);

std::string pair_text(const toml::key& key, const toml::node& value) {
  return key_text(key.str()) + " = " + node_text(value);
}

std::string node_text(const toml::node& node) {
  if (const auto number = node.as_floating_point()) return float_text(number->get());
  std::string text;
  if (const auto* array = node.as_array()) {
    for (const toml::node& one : *array) text += (text.empty() ? "" : ", ") + node_text(one);
    return "[ " + text + " ]";
  }
  if (const auto* table = node.as_table()) {
    for (const auto& [key, one] : *table) text += (text.empty() ? " " : ", ") + pair_text(key, one);
    return '{' + text + " }";
  }
  return leaf_text(node);
}

const toml::array* tables(const toml::node& node) {
  const toml::array* array = node.as_array();
  return array != nullptr && !array->empty() && array->is_homogeneous<toml::table>() ? array
                                                                                     : nullptr;
}

}  // namespace

std::string toml_lines(const toml::table& table) {
  std::string text;
  for (const auto& [key, node] : table) text += (text.empty() ? "" : "\n") + pair_text(key, node);
  return text;
}

std::string toml_text(const toml::table& document) {
  std::string text;
  for (const auto& [key, node] : document) {
    if (tables(node) == nullptr) text += pair_text(key, node) + '\n';
  }
  for (const auto& [key, node] : document) {
    const toml::array* array = tables(node);
    for (std::size_t n = 0; array != nullptr && n < array->size(); ++n) {
      text +=
          "\n[[" + key_text(key.str()) + "]]\n" + toml_lines(*array->get_as<toml::table>(n)) + '\n';
    }
  }
  return text;
}

namespace {

constexpr std::size_t kMaxBases = 16;  // scenario files in the cache

std::string file_of(const CaseRequest& request) { return "case " + std::to_string(request.number); }

void insert_number(toml::table& table, const std::string& key, double value) {
  if (value == std::round(value) && std::abs(value) < 0x1p53) {
    table.insert_or_assign(key, static_cast<std::int64_t>(value));
  } else {
    table.insert_or_assign(key, value);
  }
}

void assign_all(toml::table& to, const toml::table& from) {
  for (const auto& [key, node] : from) {
    node.visit([&, &name = key](const auto& value) { to.insert_or_assign(name, value); });
  }
}

toml::array& array_of(toml::table& document, const char* key) {
  if (!document.contains(key)) document.insert(key, toml::array{});
  return *document[key].as_array();
}

/// Returns a load as the table `load` of a scenario file.
toml::table load_table(const model::LoadParams& load) {
  toml::table table;
  table.is_inline(true);
  for (const auto& field : profile_fields::kLoad) {
    const double value = load.*std::get<double model::LoadParams::*>(field.member) / field.unit;
    // Files have no number for an absent end stop.
    if (value < field.min || value > field.max) continue;
    insert_number(table, field.key, std::round(value * 1e9) / 1e9);
  }
  return table;
}

/// Returns [[expect]] tables: one for each watched error bit of each drive, then those of `detect`.
std::vector<toml::table> watched(const CaseRequest& request, const Scenario& scenario) {
  const double duration_s = in_seconds(scenario.duration);
  std::vector<toml::table> tables;
  for (const BusConfig& bus : scenario.robot) {
    for (const ServoConfig& servo : bus.servos) {
      for (const std::string& error : request.drive_errors) {
        tables.push_back(toml::table{
            {"bus", bus.interface}, {"id", servo.id}, {"error", error}, {"by_s", duration_s}});
      }
    }
  }
  for (const toml::node& one : request.detect) tables.push_back(*one.as_table());
  return tables;
}

toml::table event_at_start(const BusConfig& bus, const ServoConfig& servo) {
  return toml::table{{"at_s", 0}, {"bus", bus.interface}, {"id", servo.id}};
}

/// Returns events at 0 s that set the supply, ambient and load of the case on every drive.
std::vector<toml::table> events_of(const CaseSettings& settings,
                                   const std::vector<BusConfig>& robot) {
  std::vector<toml::table> events;
  for (const BusConfig& bus : robot) {
    for (const ServoConfig& servo : bus.servos) {
      for (const toml::table* one : {&settings.supply, &settings.ambient}) {
        if (one->empty()) continue;
        assign_all(events.emplace_back(event_at_start(bus, servo)), *one);
      }
      if (settings.load.empty()) continue;
      toml::table load = load_table(servo.profile.drive.load);
      assign_all(load, settings.load);
      events.emplace_back(event_at_start(bus, servo)).insert("load", std::move(load));
    }
  }
  return events;
}

/// Returns a [[send]] table whose frames win every arbitration and occupy this share of the bus.
toml::table background(const BusConfig& bus, double share) {
  constexpr double kBitsPerFrame = 111 + 19 / 2.0;  // 8 bytes, and about half of the stuff bits
  const double bitrate = static_cast<double>(bus.bitrate);
  const double every_s = std::round(kBitsPerFrame / bitrate / share * 1e7) / 1e7;
  return toml::table{{"bus", bus.interface},
                     {"at_s", 0},
                     {"frame", "001#5555555555555555"},
                     {"every_s", std::max(every_s, 1e-5)}};
}

void add_background(const CaseRequest& request, const std::vector<BusConfig>& robot,
                    toml::table& document) {
  bool can_be_loaded = false;
  for (const BusConfig& bus : robot) {
    if (bus.bitrate == 0 || bus.serial) continue;
    array_of(document, "send").push_back(background(bus, request.settings.bus_load));
    can_be_loaded = true;
  }
  if (can_be_loaded) return;
  throw ConfigError(file_of(request), 0, "settings.bus_load", "needs a CAN bus with a bitrate");
}

void make_absolute(toml::table& table, const char* key, const std::filesystem::path& directory) {
  const auto given = table[key].value<std::string>();
  if (given) {
    table.insert_or_assign(key, std::filesystem::absolute(directory / *given).string());
  }
}

}  // namespace

CaseBuilder::Base& CaseBuilder::base_of(const std::string& scenario) {
  const auto known = bases_.find(scenario);
  if (known != bases_.end()) return known->second;
  if (bases_.size() >= kMaxBases) bases_.clear();
  const std::filesystem::path file = meant_file(kScenarios, scenario);
  const std::string text = read_regular_file(file, kLongestText);
  Base base{file, text_hash(text), parse_toml(text, file.string()),
            std::make_unique<CaseFiles>(file.parent_path())};
  return bases_.emplace(scenario, std::move(base)).first->second;
}

toml::table CaseBuilder::changed(const CaseRequest& request, Base& base) {
  toml::table document = base.document;
  assign_all(document, request.keys);
  const CaseSettings& settings = request.settings;
  const bool surroundings =
      !settings.supply.empty() || !settings.ambient.empty() || !settings.load.empty();
  if (surroundings || settings.bus_load > 0) {
    const auto robot =
        parse_scenario(document, base.file.string(), std::nullopt, base.files->files()).robot;
    if (surroundings) {
      // Inserts these events before the scenario's own, so that those at 0 s override them.
      const std::vector<toml::table> events = events_of(settings, robot);
      toml::array& all = array_of(document, "event");
      all.insert(all.cbegin(), events.begin(), events.end());
    }
    if (settings.bus_load > 0) add_background(request, robot, document);
  }
  for (const toml::node& directive : request.directives) {
    array_of(document, "event").push_back(*directive.as_table());
  }
  return document;
}

CaseCourse CaseBuilder::course(const CaseRequest& request) {
  Base& base = base_of(request.scenario);
  CaseCourse course;
  course.scenario =
      parse_scenario(changed(request, base), base.file.string(), std::nullopt, base.files->files());
  course.inputs = base.hash + base.files->hash();
  Scenario& scenario = course.scenario;
  course.own = scenario.expectations.size();
  for (const toml::table& table : watched(request, scenario)) {
    TableReader reader(table, file_of(request), "detect");
    scenario.expectations.push_back(read_expectation(reader, scenario));
    reader.finish();
  }
  course.drive_errors = scenario.expectations.size() - course.own - request.detect.size();
  const std::vector<Expectation>& all = scenario.expectations;
  std::vector<std::size_t> by_bus(all.size());
  std::iota(by_bus.begin(), by_bus.end(), std::size_t{0});
  std::ranges::stable_sort(by_bus, {}, [&](std::size_t n) { return all[n].bus; });
  course.places.resize(all.size());
  for (std::size_t n = 0; n < all.size(); ++n) course.places[by_bus[n]] = n;
  return course;
}

std::vector<PlannedDirective> CaseBuilder::fault(const CaseRequest& request,
                                                 const Scenario& scenario) {
  if (!request.fault) return {};
  const toml::table& event = *request.fault;
  TableReader reader(event, file_of(request), "fault");
  std::optional<int> id;
  if (const auto given = event["id"].value<std::int64_t>()) id = static_cast<int>(*given);
  const std::size_t bus = read_bus_of(reader, scenario.robot, id);
  read_moment(reader, "at_s", scenario.duration);
  if (reader.has("when"))
    reader.fail("when",
                "not allowed: a case's fault begins at at_s; move this event to directives");
  std::vector<TimedDirective> all = scenario.robot[bus].events;
  std::vector<PlannedDirective> planned;
  for (TimedDirective& one : read_directives(reader, scenario.robot[bus], Timing::kRequired)) {
    if (!std::holds_alternative<SetFault>(one.directive.what)) reader.fail("", "is not a fault");
    all.push_back(one);
    planned.push_back({bus, std::move(one)});
  }
  check_room(reader, all);
  return planned;
}

std::string CaseBuilder::file_text(const CaseRequest& request) {
  const Scenario scenario = course(request).scenario;
  fault(request, scenario);  // throws if the drive cannot have the fault
  Base& base = base_of(request.scenario);
  toml::table document = changed(request, base);
  const std::filesystem::path directory = base.file.parent_path();
  if (is_path(document["robot"].value_or(""))) make_absolute(document, "robot", directory);
  if (auto* sends = document["send"].as_array()) {
    for (toml::node& send : *sends) make_absolute(*send.as_table(), "play", directory);
  }
  if (!request.drive_errors.empty() || !request.detect.empty()) {
    toml::array& all = array_of(document, "expect");
    for (toml::table& table : watched(request, scenario)) all.push_back(std::move(table));
  }
  if (request.fault) array_of(document, "event").push_back(*request.fault);
  return toml_text(document);
}

}  // namespace lk::emulator
