#include "tools/campaign/plan/plan_dimensions.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "emulator/config/config.hpp"
#include "emulator/config/profile_fields.hpp"
#include "emulator/core/faults/fault_table.hpp"
#include "emulator/core/generation.hpp"

namespace lk::emulator {
namespace {

constexpr double kAnything = 1e12;
constexpr double kMostSeeds = 0x1p53;  // which a number keeps exactly

/// What a dimension of a name is, before its values are read.
struct Allowed {
  Dimension dimension;
  double min = -kAnything, max = kAnything;
  Rounding rounding = Rounding::kFigures;
  std::vector<std::string> words = {};  // it is one of these
  bool any_word = false;                // a number or any word
};

Dimension named(const std::string& name, Target target, std::string kind = "",
                std::string key = "") {
  return {name, target, std::move(kind), std::move(key), DimensionValues::listed({CaseValue(0.0)}),
          false};
}

std::vector<Allowed> simple_dimensions() {
  using enum Target;
  std::vector<std::string> kinds;
  for (const FaultRow& row : fault_table()) kinds.emplace_back(row.word);
  return {
      {.dimension = named("fault.kind", kFaultKind), .words = kinds},
      {.dimension = named("fault.bus", kFaultBus), .any_word = true},
      {named("fault.id", kFaultId), protocol::kMinId, protocol::kMaxId, Rounding::kWhole},
      {named("fault.at_s", kFaultAt), 0, 1e6, Rounding::kMilliseconds},
      {named("fault.for_s", kFaultFor), 0.001, 1e6, Rounding::kMilliseconds},
      {named("fault.probability", kFaultProbability), 0, 1},
      {named("seed", kSeed), 0, kMostSeeds, Rounding::kWhole},
      {named("bitrate", kBitrate), 0, 1e6, Rounding::kWhole},
      {.dimension = named("generation", kGeneration), .words = generation_names()},
      {named("bus_load", kBusLoad), 0, 0.95},
      {named("supply_V", kSupply), 0, 100},
      {named("ambient_C", kAmbient), -40, 125},
  };
}

/// "fault.jam.percent": a parameter of a kind.
std::optional<Allowed> fault_param(const std::string& name) {
  constexpr std::string_view kPrefix = "fault.";
  if (!name.starts_with(kPrefix)) return std::nullopt;
  const std::string rest = name.substr(kPrefix.size());
  const std::size_t dot = rest.find('.');
  const FaultRow* const row = find_fault(rest.substr(0, dot));
  if (row == nullptr || dot == std::string::npos) return std::nullopt;
  const std::string key = rest.substr(dot + 1);
  for (const FaultParam& param : row->params) {
    if (param.word.empty() || param.word != key) continue;
    Allowed allowed{named(name, Target::kFaultParam, std::string(row->word), key), param.min,
                    param.max, param.whole ? Rounding::kWhole : Rounding::kFigures};
    allowed.words.assign(param.choices.begin(), param.choices.end());
    return allowed;
  }
  return std::nullopt;
}

std::optional<Allowed> load_field(const std::string& name) {
  for (const auto& field : profile_fields::kLoad) {
    if (name != std::string("load.") + field.key) continue;
    return Allowed{named(name, Target::kLoad, "", field.key), field.min, field.max};
  }
  return std::nullopt;
}

std::optional<Allowed> allowed_of(const std::string& name) {
  for (Allowed& simple : simple_dimensions()) {
    if (simple.dimension.name == name) return std::move(simple);
  }
  if (auto param = fault_param(name)) return param;
  if (auto load = load_field(name)) return load;
  if (name.starts_with("host.") && name.size() > 5) {
    Allowed host{named(name, Target::kHost, "", name.substr(5))};
    host.any_word = true;
    return host;
  }
  return std::nullopt;
}

/// All that a dimension can be called, but those of hosts.
std::vector<std::string> known_names() {
  std::vector<std::string> names;
  for (const Allowed& simple : simple_dimensions()) names.push_back(simple.dimension.name);
  for (const FaultRow& row : fault_table()) {
    for (const FaultParam& param : row.params) {
      if (param.word.empty()) break;
      names.push_back("fault." + std::string(row.word) + "." + std::string(param.word));
    }
  }
  for (const auto& field : profile_fields::kLoad) names.push_back(std::string("load.") + field.key);
  return names;
}

/// Reads what one name stands for.
class ValuesReader {
 public:
  ValuesReader(const toml::node& node, std::string file, const Allowed& allowed,
               const std::vector<std::string>& kinds)
      : node_(node), file_(std::move(file)), allowed_(allowed), kinds_(kinds) {}

  DimensionValues read() const {
    if (const auto* word = node_.as_string();
        word != nullptr && **word == "all" && !allowed_.words.empty()) {
      return DimensionValues::listed(all_words());
    }
    if (const auto* table = node_.as_table()) return read_table(*table);
    return DimensionValues::listed(read_list(node_));
  }
  bool least_is_to() const {
    const auto* table = node_.as_table();
    const toml::node* const least = table != nullptr ? table->get("least") : nullptr;
    if (least == nullptr) return false;
    const auto word = least->value<std::string>();
    if (word != "from" && word != "to") fail(*least, R"(least: is "from" or "to")");
    return word == "to";
  }
  std::vector<CaseValue> read_list(const toml::node& node) const {
    std::vector<CaseValue> values;
    if (const auto* array = node.as_array()) {
      for (const toml::node& element : *array) values.push_back(read_value(element));
    } else {
      values.push_back(read_value(node));
    }
    if (values.empty()) fail(node, "is empty");
    for (std::size_t n = 0; n < values.size(); ++n) {
      if (values[n].index() != values.front().index()) fail(node, "mixes numbers and words");
      if (std::find(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(n), values[n]) !=
          values.begin() + static_cast<std::ptrdiff_t>(n)) {
        fail(node, "has " + value_text(values[n]) + " twice");
      }
    }
    return values;
  }
  [[noreturn]] void fail(const toml::node& node, const std::string& reason) const {
    throw ConfigError(file_, static_cast<int>(node.source().begin.line),
                      "dimension." + allowed_.dimension.name, reason);
  }
  double read_number(const toml::node& node) const {
    const auto number = node.value<double>();
    if (!number || !node.is_number() || !std::isfinite(*number)) fail(node, "must be a number");
    if (*number < allowed_.min || *number > allowed_.max) {
      fail(node, value_text(*number) + " is out of range (" + value_text(allowed_.min) + " to " +
                     value_text(allowed_.max) + ")");
    }
    if (allowed_.rounding == Rounding::kWhole && *number != std::round(*number)) {
      fail(node, "must be a whole number");
    }
    return *number;
  }

 private:
  std::vector<CaseValue> all_words() const {
    const bool of_kinds = allowed_.dimension.target == Target::kFaultKind;
    const std::vector<std::string>& words = of_kinds ? kinds_ : allowed_.words;
    return {words.begin(), words.end()};
  }
  CaseValue read_value(const toml::node& node) const {
    const auto word = node.value<std::string>();
    if (word && (allowed_.any_word || !allowed_.words.empty())) {
      if (!allowed_.any_word && std::ranges::find(allowed_.words, *word) == allowed_.words.end()) {
        const std::string meant = nearest(*word, allowed_.words);
        fail(node, '"' + *word + "\" is unknown" +
                       (meant.empty() ? "" : ", did you mean " + meant + "?"));
      }
      return *word;
    }
    if (!allowed_.words.empty()) fail(node, "must be a word or a list of words");
    const double number = read_number(node);
    if (allowed_.dimension.target == Target::kBitrate) {
      const std::string problem = bitrate_problem(static_cast<std::int64_t>(number));
      if (!problem.empty()) fail(node, problem);
    }
    return number;
  }
  DimensionValues read_table(const toml::table& table) const {
    check_keys(table);
    if (const toml::node* values = table.get("values")) return weighted(table, *values);
    if (!allowed_.words.empty()) fail(table, "must be a word or a list of words");
    const toml::node* const from = table.get("from");
    const toml::node* const to = table.get("to");
    if (from == nullptr || to == nullptr) fail(table, "a range needs from and to");
    DimensionValues::Range range{.from = read_number(*from),
                                 .to = read_number(*to),
                                 .mean = std::nullopt,
                                 .rounding = allowed_.rounding};
    if (!(range.from < range.to)) fail(*to, "the range is empty: to must be above from");
    if (table.get("step") != nullptr) return stepped(table, range);
    range.log = table["log"].value_or(false);
    if (range.log && range.from <= 0) fail(*from, "must be above 0 for log");
    if (const toml::node* mean = table.get("mean")) {
      const auto sd = table["sd"].value<double>();
      if (!sd || !(*sd > 0) || *sd > kAnything) fail(table, "mean needs sd, above 0");
      range.mean = read_number(*mean);
      range.sd = *sd;
      if (range.log) fail(table, "log does not go together with mean");
    } else if (table.get("sd") != nullptr) {
      fail(table, "sd needs mean");
    }
    return DimensionValues::ranged(range);
  }
  void check_keys(const toml::table& table) const {
    const std::vector<std::string> known = {"from", "to",     "step",    "log",  "mean",
                                            "sd",   "values", "weights", "least"};
    for (const auto& [key, value] : table) {
      if (std::ranges::find(known, key.str()) == known.end()) {
        fail(value, "unknown key " + std::string(key.str()) + "; known are " + comma_list(known));
      }
      const bool of_list = key == "values" || key == "weights" || key == "least";
      if (table.contains("values") != of_list && key != "least") {
        fail(value, std::string(key.str()) + " does not go together with the others");
      }
    }
  }
  DimensionValues weighted(const toml::table& table, const toml::node& values) const {
    std::vector<CaseValue> list = read_list(values);
    std::vector<double> weights;
    const toml::array* const given = table["weights"].as_array();
    if (given == nullptr) fail(table, "values without weights are a list: [ … ]");
    for (const toml::node& weight : *given) {
      const auto number = weight.value<double>();
      if (!number || !(*number >= 0) || *number > kAnything) fail(weight, "weights are 0 or more");
      weights.push_back(*number);
    }
    if (weights.size() != list.size()) fail(*given, "needs as many weights as values");
    if (std::ranges::all_of(weights, [](double weight) { return weight == 0; })) {
      fail(*given, "all weights are 0");
    }
    return DimensionValues::listed(std::move(list), std::move(weights));
  }
  DimensionValues stepped(const toml::table& table, const DimensionValues::Range& range) const {
    constexpr double kMostSteps = 1e6;
    for (const char* key : {"log", "mean", "sd"}) {
      if (table.contains(key)) fail(table, std::string(key) + " does not go together with step");
    }
    const auto step = table["step"].value<double>();
    if (!step || !(*step > 0) || (range.to - range.from) / *step > kMostSteps) {
      fail(table, "step must be above 0, and a millionth of the range or more");
    }
    std::vector<CaseValue> values;
    const auto steps = static_cast<int>(std::floor((range.to - range.from) / *step + 1e-9));
    for (int n = 0; n <= steps; ++n) {
      // As a person would write it: without the last bits of the multiplication.
      const double raw = range.from + n * *step;
      values.emplace_back(std::round(raw * 1e9) / 1e9);
    }
    return DimensionValues::listed(std::move(values));
  }

  const toml::node& node_;
  std::string file_;
  const Allowed& allowed_;
  const std::vector<std::string>& kinds_;
};

bool is_values(const toml::table& table) {
  return std::ranges::any_of(std::initializer_list<const char*>{"from", "to", "values", "mean"},
                             [&](const char* key) { return table.contains(key); });
}

/// `fault.kind = …` is a table in a table; "fault.kind" = … is not. Both mean the same.
void flatten(const toml::table& table, const std::string& prefix,
             std::vector<std::pair<std::string, const toml::node*>>& out) {
  for (const auto& [key, node] : table) {
    const std::string name = prefix + std::string(key.str());
    const toml::table* const inner = node.as_table();
    if (inner != nullptr && !is_values(*inner) && !inner->empty()) {
      flatten(*inner, name + ".", out);
    } else {
      out.emplace_back(name, &node);
    }
  }
}

std::vector<std::pair<std::string, const toml::node*>> by_line(const toml::table& table) {
  std::vector<std::pair<std::string, const toml::node*>> all;
  flatten(table, "", all);
  std::ranges::stable_sort(all, {}, [](const auto& one) {
    const auto& begin = one.second->source().begin;
    return std::pair(begin.line, begin.column);
  });
  return all;
}

}  // namespace

std::vector<Dimension> read_dimensions(const toml::table& table, const std::string& file,
                                       const std::vector<std::string>& kinds) {
  std::vector<Dimension> dimensions;
  for (const auto& [name, node] : by_line(table)) {
    auto allowed = allowed_of(name);
    if (!allowed) {
      const std::string meant = nearest(name, known_names());
      throw ConfigError(
          file, static_cast<int>(node->source().begin.line), "dimension." + name,
          "unknown dimension" + (meant.empty() ? "" : ", did you mean " + meant + "?"));
    }
    const ValuesReader reader(*node, file, *allowed, kinds);
    Dimension dimension = allowed->dimension;
    dimension.values = reader.read();
    dimension.least_is_to = reader.least_is_to();
    if (std::ranges::find(dimensions, name, &Dimension::name) != dimensions.end()) {
      reader.fail(*node, "is there twice");
    }
    dimensions.push_back(std::move(dimension));
  }
  return dimensions;
}

Exclusion read_exclusion(const toml::table& table, const std::string& file,
                         const std::vector<Dimension>& dimensions) {
  Exclusion exclusion;
  for (const auto& [name, node] : by_line(table)) {
    const auto place = std::ranges::find(dimensions, name, &Dimension::name);
    const auto line = static_cast<int>(node->source().begin.line);
    if (place == dimensions.end()) {
      throw ConfigError(file, line, "exclude." + name, "is no dimension of this plan");
    }
    const auto allowed = allowed_of(name);
    const ValuesReader reader(*node, file, *allowed, {});
    ExcludedValues excluded;
    excluded.dimension = static_cast<std::size_t>(place - dimensions.begin());
    if (const auto* range = node->as_table()) {
      const auto fail = [&, at = line, key = "exclude." + name](const std::string& reason) {
        throw ConfigError(file, at, key, reason);
      };
      const toml::node* const from = range->get("from");
      const toml::node* const to = range->get("to");
      for (const auto& [key, value] : *range) {
        if (&value == from || &value == to) continue;
        fail("unknown key " + std::string(key.str()) + "; known are from, to");
      }
      if (place->values.has_words()) fail("has words, and no range: give one or a list");
      excluded.from = from != nullptr ? reader.read_number(*from) : -kAnything;
      excluded.to = to != nullptr ? reader.read_number(*to) : kAnything;
      if (excluded.from > excluded.to) fail("the range is empty: to is below from");
    } else {
      excluded.values = reader.read_list(*node);
    }
    exclusion.push_back(std::move(excluded));
  }
  if (exclusion.empty()) {
    throw ConfigError(file, static_cast<int>(table.source().begin.line), "exclude",
                      "is empty: it would leave out every case");
  }
  return exclusion;
}

}  // namespace lk::emulator
