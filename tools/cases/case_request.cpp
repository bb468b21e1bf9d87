#include "tools/cases/case_request.hpp"

#include <utility>

#include "emulator/config/events/config_directives.hpp"
#include "emulator/config/profile_fields.hpp"

namespace lk::emulator {
namespace {

constexpr std::int64_t kMaxNumber = std::int64_t{1} << 53;  // every JSON library reads it exactly
constexpr std::size_t kMaxPath = 4096;                      // bytes, as in Linux

/// Moves `key` from `from` to `to`, if `from` has it.
void take(toml::table& from, const char* key, toml::table& to) {
  if (toml::node* node = from.get(key)) {
    node->visit([&](auto& value) { to.insert(key, std::move(value)); });
    from.erase(key);
  }
}

toml::array take_tables(TableReader& reader, toml::table& from, const char* key) {
  toml::array* given = from[key].as_array();
  if (given != nullptr && given->empty()) {
    reader.texts(key);  // marks the key as read; tables() would refuse an empty array
    return {};
  }
  reader.tables(key);  // throws if the value is not an array of tables
  return given != nullptr ? std::move(*given) : toml::array{};
}

CaseSettings read_settings(TableReader& reader, toml::table& table) {
  CaseSettings settings;
  reader.number("supply_V", 0, 100);
  reader.number("ambient_C", -40, 125);
  settings.bus_load = reader.number("bus_load", 0, 0.95).value_or(0);
  if (auto load = reader.table("load")) {
    for (const auto& field : profile_fields::kLoad) load->number(field.key, field.min, field.max);
    load->finish();
    settings.load = std::move(*table["load"].as_table());
  }
  reader.finish();
  take(table, "supply_V", settings.supply);
  take(table, "ambient_C", settings.ambient);
  return settings;
}

}  // namespace

std::uint64_t read_case_number(const Json& line) {
  if (!line.is_object()) throw JsonError("case", "expected a JSON object");
  const auto found = line.find("case");
  if (found == line.end() || !found->is_number_integer()) {
    throw JsonError("case", "missing, or not a whole number");
  }
  const auto number = found->get<std::int64_t>();
  if (number < 0 || number > kMaxNumber) throw JsonError("case", "out of range (0 to 2^53)");
  return static_cast<std::uint64_t>(number);
}

CaseRequest read_case(const Json& line) {
  CaseRequest request;
  request.number = read_case_number(line);
  toml::table table = parse_json_table(line.dump());
  TableReader reader(table, "case " + std::to_string(request.number), "");
  reader.integer("case", 0, kMaxNumber);
  if (const auto scenario = reader.text("scenario")) {
    const std::string problem = text_problem(*scenario, kMaxPath);
    if (!problem.empty()) reader.fail("scenario", problem);
    request.scenario = *scenario;
  } else {
    reader.note_missing("scenario");
  }
  reader.integer("seed", 0, INT64_MAX);
  reader.integer("bitrate", 0, INT64_MAX);
  reader.text("generation");
  request.drive_errors = reader.texts("drive_errors");
  request.directives = take_tables(reader, table, "directives");
  request.detect = take_tables(reader, table, "detect");
  if (auto settings = reader.table("settings")) {
    request.settings = read_settings(*settings, *table["settings"].as_table());
  }
  if (reader.table("fault")) request.fault = std::move(*table["fault"].as_table());
  reader.finish();
  for (const char* key : {"seed", "bitrate", "generation"}) take(table, key, request.keys);
  Json group = line;
  group.erase("case");
  group.erase("fault");
  request.group = group.dump();
  return request;
}

}  // namespace lk::emulator
