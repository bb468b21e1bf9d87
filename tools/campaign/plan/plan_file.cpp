#include "tools/campaign/plan/plan_file.hpp"

#include <algorithm>
#include <regex>
#include <sstream>
#include <stdexcept>

#include "emulator/config/config_reader.hpp"
#include "emulator/config/events/config_directives.hpp"
#include "emulator/files/profile_files.hpp"
#include "emulator/files/regular_file.hpp"
#include "emulator/ground/start_error.hpp"
#include "tools/cases/case_files.hpp"
#include "tools/campaign/plan/case_scenario.hpp"
#include "tools/campaign/plan/host_words.hpp"
#include "tools/campaign/plan/plan_dimensions.hpp"
#include "tools/campaign/plan/sampling.hpp"
#include "tools/cases/toml_text.hpp"

namespace lk::emulator {
namespace {

constexpr std::int64_t kRealtimeRuns = 2;  // the least that shows a case that goes both ways
constexpr std::int64_t kMostNumbers = 1'000'000'000'000'000;

void check_regex(TableReader& reader, const std::string& key, const std::string& pattern) {
  try {
    const std::regex compiled(pattern);
  } catch (const std::regex_error& problem) {
    reader.fail(key, '"' + pattern + "\" is no regular expression: " + problem.what());
  }
}

void read_host_rule(TableReader& reader, const toml::table& table, Detection& detection) {
  if (const auto line = reader.text("says")) {
    check_regex(reader, "says", *line);
    detection.lines.push_back(*line);
  } else if (const auto status = reader.integer("exit_status", 0, 255)) {
    detection.exit_status.push_back(static_cast<int>(*status));
  } else if (reader.has("reply") || reader.has("answered")) {
    // Read as an [[expect]] of the scenario, where what is wrong with it is told.
    for (const char* key : {"reply", "answered"}) {
      if (reader.has(key)) reader.table(key);
    }
    reader.integer("id", protocol::kMinId, protocol::kMaxId);
    reader.text("bus");
    if (!reader.has("id")) reader.note_missing("id");
    const std::string toml = toml_lines(table);
    std::string text = toml;
    std::ranges::replace(text, '\n', ' ');
    detection.host.push_back({toml, text});
  } else {
    reader.finish();
    reader.fail("", "needs one of reply, answered, says and exit_status");
  }
  reader.finish();
}

Detection read_detection(TableReader& reader, const toml::table& table) {
  Detection detection;
  std::vector<std::string> words = {"any", "none"};
  for (int n = 0; n < model::kErrorKinds; ++n) {
    words.emplace_back(error_word(static_cast<model::Error>(n)));
  }
  const auto check = [&](const std::string& word) {
    if (std::ranges::find(words, word) == words.end()) {
      reader.fail("drive", '"' + word + "\" is not one of " + comma_list(words));
    }
  };
  if (reader.is_text("drive")) {
    const std::string word = *reader.text("drive");
    check(word);
    detection.by_drive = word != "none";
    if (word != "any" && word != "none") detection.drive_errors = {word};
  } else {
    detection.drive_errors = reader.texts("drive");
    for (const std::string& word : detection.drive_errors) check(word);
  }
  const toml::array* const rules = table["host"].as_array();
  std::size_t n = 0;
  for (TableReader& rule : reader.tables("host")) {
    read_host_rule(rule, *rules->get(n++)->as_table(), detection);
  }
  reader.finish();
  return detection;
}

HostProgram read_host(TableReader& reader) {
  HostProgram host;
  if (reader.is_text("command")) {
    try {
      host.command = command_words(*reader.text("command"));
    } catch (const std::invalid_argument& problem) {
      reader.fail("command", problem.what());
    }
  } else {
    host.command = reader.texts("command");
  }
  if (host.command.empty()) reader.note_missing("command");
  host.bus = reader.text("bus").value_or(host.bus);
  host.stepped = reader.choice("clock", {"realtime", "stepped"}).value_or(0) == 1;
  host.timeout_s = reader.number("timeout_s", 0.1, 1e5).value_or(host.timeout_s);
  const auto runs = reader.integer("runs", 1, 1000);
  host.runs = static_cast<int>(runs.value_or(host.stepped ? 1 : kRealtimeRuns));
  if (host.stepped && host.runs > 1) {
    reader.fail("runs", "is of clock = \"realtime\": a stepped host does the same each time");
  }
  reader.finish();
  return host;
}

std::filesystem::path scenario_path(const std::string& given, const std::filesystem::path& plan) {
  const bool path = given.ends_with(".toml") || given.find('/') != std::string::npos;
  return path ? plan.parent_path() / given : shipped_file(kScenarios, given);
}

void read_scenario(TableReader& reader, Plan& plan) {
  const auto given = reader.text("scenario");
  if (!given) {
    reader.note_missing("scenario");
    return;
  }
  try {
    plan.scenario_file = scenario_path(*given, plan.file);
    plan.scenario_text = read_regular_file(plan.scenario_file, kLongestText);
  } catch (const std::invalid_argument& problem) {
    reader.fail("scenario", problem.what());
  }
}

void read_head(TableReader& reader, Plan& plan) {
  CampaignHead& head = plan.head;
  head.version = LKEMU_VERSION;
  head.plan_name = plan.file.stem().string();
  head.about = reader.text("about").value_or("");
  const auto sampling = reader.choice("sampling", {kSamplingWords.begin(), kSamplingWords.end()});
  if (!sampling) reader.note_missing("sampling");
  head.sampling = static_cast<Sampling>(sampling.value_or(0));
  head.seed = static_cast<std::uint64_t>(reader.integer("seed", 0, INT64_MAX).value_or(1));
  const auto cases = reader.integer("cases", 1, kMostNumbers);
  const bool counted = head.sampling == Sampling::kRandom || head.sampling == Sampling::kLatin ||
                       head.sampling == Sampling::kAdaptive;
  if (counted && !cases) reader.note_missing("cases");
  if (!counted && cases) reader.fail("cases", "belongs to random, latin and adaptive");
  head.numbers = static_cast<std::uint64_t>(cases.value_or(0));
  head.tolerant_time = read_duration(reader, "tolerant_time_s");
}

/// The kinds that drives of this robot can have.
std::vector<std::string> possible_kinds(const Scenario& base) {
  std::vector<std::string> kinds;
  const BusConfig& bus = base.robot.front();
  for (const FaultRow& row : fault_table()) {
    const bool fits = !row.serial || bus.serial.has_value();
    const Fault fault = fault_of(row);
    const bool some = row.impossible == nullptr || row.of_bus ||
                      std::ranges::any_of(bus.servos, [&](const ServoConfig& servo) {
                        return row.impossible(fault, servo).empty();
                      });
    if (fits && some) kinds.emplace_back(row.word);
  }
  return kinds;
}

void check_hazards(TableReader& reader, const Plan& plan, const Scenario& base) {
  for (const std::string& hazard : plan.hazards) {
    const bool known = std::ranges::any_of(
        base.expectations, [&](const Expectation& one) { return one.says == hazard; });
    if (!known)
      reader.fail("expectations", "the scenario expects nothing that says \"" + hazard + '"');
  }
}

/// What a fault of this kind has to be told.
void check_kind(const TableReader& reader, const Plan& plan, const FaultRow& row) {
  const auto varied = [&](std::string_view word) {
    return std::ranges::any_of(plan.dimensions, [&](const Dimension& one) {
      return one.target == Target::kFaultParam && one.kind == row.word && one.key == word;
    });
  };
  std::string first;
  bool one = !row.needs_one;
  for (const FaultParam& param : row.params) {
    if (param.word.empty()) break;
    if (first.empty()) first = param.word;
    const std::string name = "\"fault." + std::string(row.word) + "." + std::string(param.word);
    if (param.required && !varied(param.word)) {
      reader.fail("dimension", name + "\" is required: give it a value, a list or a range");
    }
    one = one || varied(param.word);
  }
  if (!one) {
    reader.fail("dimension", "\"fault." + std::string(row.word) + "." + first +
                                 "\" or another of its parameters is required");
  }
}

void check_fault(const TableReader& reader, const Plan& plan) {
  const Dimension* const kinds = plan.find(Target::kFaultKind);
  if (kinds == nullptr) {
    for (const Dimension& dimension : plan.dimensions) {
      if (!dimension.name.starts_with("fault.")) continue;
      reader.fail("dimension", dimension.name + " needs fault.kind");
    }
    return;
  }
  if (plan.find(Target::kFaultAt) == nullptr) {
    reader.fail("dimension", "fault.kind needs fault.at_s");
  }
  const auto is_kind = [&](const Dimension& dimension) {
    const auto& values = kinds->values.values();
    return std::ranges::find(values, CaseValue(dimension.kind)) != values.end();
  };
  for (const Dimension& dimension : plan.dimensions) {
    if (dimension.target == Target::kFaultParam && !is_kind(dimension)) {
      reader.fail("dimension", dimension.name + ": fault.kind never is " + dimension.kind);
    }
  }
  for (const CaseValue& word : kinds->values.values()) {
    check_kind(reader, plan, *find_fault(std::get<std::string>(word)));
  }
}

void check_lists(const TableReader& reader, const Plan& plan) {
  if (plan.head.sampling != Sampling::kFull && plan.head.sampling != Sampling::kPairwise) return;
  for (const Dimension& dimension : plan.dimensions) {
    if (dimension.values.is_listed()) continue;
    reader.fail("dimension",
                dimension.name + ": sampling " +
                    std::string(kSamplingWords[static_cast<std::size_t>(plan.head.sampling)]) +
                    " needs a list, or a step in the range");
  }
}

/// How many cases there are: counted one by one, where some are excluded and that takes no time.
void count_cases(Plan& plan) {
  const CaseNumbers numbers(plan);
  plan.head.numbers = plan.head.cases = numbers.numbers();
  const bool dropped =
      plan.head.sampling == Sampling::kFull || plan.head.sampling == Sampling::kLatin;
  if (plan.exclusions.empty() || !dropped || numbers.numbers() > kMostCounted) return;
  for (std::uint64_t n = 0; n < numbers.numbers(); ++n) {
    if (!numbers.values(n)) --plan.head.cases;
  }
}

DimensionHead head_of(const Dimension& dimension) {
  DimensionHead head{dimension.name, {}, 0, 0, dimension.least_is_to};
  if (dimension.values.has_words()) {
    for (const CaseValue& word : dimension.values.values()) {
      head.words.push_back(std::get<std::string>(word));
    }
  } else {
    head.from = dimension.values.least();
    head.to = dimension.values.most();
  }
  return head;
}

std::string hexadecimal(std::uint64_t number) {
  std::ostringstream text;
  text << std::hex << number;
  std::string digits = text.str();
  digits.insert(0, 16 - digits.size(), '0');
  return digits;
}

}  // namespace

Plan parse_plan(const std::string& text, const std::filesystem::path& file) {
  const toml::table document = parse_toml(text, file.string());
  TableReader reader(document, file.string(), "");
  Plan plan;
  plan.file = file;
  read_head(reader, plan);
  plan.head.plan_text = text;
  read_scenario(reader, plan);
  auto dimensions = reader.table("dimension");
  if (!dimensions) reader.note_missing("dimension");
  reader.tables("exclude");
  auto hazard = reader.table("hazard");
  if (hazard) {
    plan.hazards = hazard->texts("expectations");
    hazard->finish();
  }
  if (auto detect = reader.table("detect")) {
    plan.detection = read_detection(*detect, *document["detect"].as_table());
  }
  if (auto host = reader.table("host")) plan.host = read_host(*host);
  reader.finish();

  CaseFiles files(plan.scenario_file.parent_path());
  const Scenario base =
      parse_scenario(plan.scenario_text, plan.scenario_file.string(), std::nullopt, files.files());
  plan.dimensions =
      read_dimensions(*document["dimension"].as_table(), file.string(), possible_kinds(base));
  if (plan.dimensions.empty()) reader.fail("dimension", "is empty");
  if (const toml::array* exclusions = document["exclude"].as_array()) {
    for (const toml::node& exclusion : *exclusions) {
      plan.exclusions.push_back(
          read_exclusion(*exclusion.as_table(), file.string(), plan.dimensions));
    }
  }
  if (hazard) check_hazards(*hazard, plan, base);
  check_fault(reader, plan);
  check_lists(reader, plan);
  count_cases(plan);
  if (plan.head.cases == 0) reader.fail("exclude", "leaves no case");
  for (const Dimension& dimension : plan.dimensions) {
    plan.head.dimensions.push_back(head_of(dimension));
  }
  std::uint64_t hash = files.hash();
  if (plan.host) hash = files_hash(plan.host->command, file.parent_path(), hash);
  plan.head.input_hash = hexadecimal(text_hash(text, text_hash(plan.scenario_text, hash)));
  return plan;
}

Plan load_plan(const std::string& given) {
  try {
    const std::filesystem::path file = meant_file(kCampaigns, given);
    Plan plan = parse_plan(read_regular_file(file, kLongestText), file);
    plan.head.plan_called.word = given;
    return plan;
  } catch (const ConfigError& problem) {
    throw StartError(problem.what());
  } catch (const std::invalid_argument& problem) {
    throw StartError(problem.what());
  }
}

}  // namespace lk::emulator
