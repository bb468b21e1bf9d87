#include "tools/campaign/report/answer_json.hpp"

#include <algorithm>
#include <unordered_map>
#include <utility>

#include "emulator/files/json_table.hpp"

namespace lk::emulator {
namespace {

std::string json_line(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
}

Json seconds_json(const std::optional<SimTime>& time) {
  return time ? Json(seconds_of(*time)) : Json(nullptr);
}

template <typename Value>
Json optional_json(const std::optional<Value>& value) {
  return value ? Json(*value) : Json(nullptr);
}

Json dimension_json(const DimensionHead& dimension) {
  Json json = {{"name", dimension.name}};
  if (dimension.words.empty()) {
    json["from"] = dimension.from;
    json["to"] = dimension.to;
  } else {
    json["words"] = dimension.words;
  }
  return json;
}

Json campaign_json(const CampaignHead& head) {
  Json dimensions = Json::array();
  for (const DimensionHead& one : head.dimensions) dimensions.push_back(dimension_json(one));
  return {{"name", head.plan_name},
          {"about", head.about},
          {"version", head.version},
          {"sampling", kSamplingWords.at(static_cast<std::size_t>(head.sampling))},
          {"seed", head.seed},
          {"numbers", head.numbers},
          {"cases", head.cases},
          {"tolerant_time_s", seconds_json(head.tolerant_time)},
          {"input_hash", head.input_hash},
          {"dimensions", std::move(dimensions)},
          {"plan", head.plan_text}};
}

Json latencies_json(const LatencyCounts& latencies) {
  Json bins = Json::array();
  for (const auto& bin : latencies.bins()) bins.push_back(Json::array({bin.up_to_s, bin.count}));
  return {{"cases", latencies.count()},
          {"p50_s", seconds_json(latencies.quantile(0.5))},
          {"p99_s", seconds_json(latencies.quantile(0.99))},
          {"worst_s", seconds_json(latencies.worst())},
          {"rounded", latencies.rounded()},
          {"bins", std::move(bins)}};
}

Json coverage_json(const Coverage& coverage) {
  Json json = {{"covered", coverage.covered},
               {"dangerous", coverage.dangerous},
               {"share", optional_json(coverage.share())}};
  json["interval"] = coverage.interval
                         ? Json::array({coverage.interval->lower, coverage.interval->upper})
                         : Json(nullptr);
  Json needs = Json::array();
  for (const ClaimNeed& need : coverage.needs) {
    needs.push_back({{"claim", need.claim},
                     {"met", need.met},
                     {"all_detected", need.all_hits},
                     {"at_this_share", optional_json(need.at_this_share)}});
  }
  json["needs"] = std::move(needs);
  return json;
}

Json counts_json(const OutcomeCounts& counts) {
  Json json = Json::object();
  for (std::size_t n = 0; n < kCaseOutcomes; ++n) {
    json[outcome_key(static_cast<CaseOutcome>(n))] = counts.at(n);
  }
  return json;
}

Json kind_json(const KindAnswer& of) {
  return {{"kind", of.kind},
          {"cases", of.cases()},
          {"outcomes", counts_json(of.outcomes)},
          {"coverage", coverage_json(of.coverage)},
          {"latency",
           {{"drive", latencies_json(of.by_drive)},
            {"host", latencies_json(of.by_host)},
            {"first", latencies_json(of.detected)}}}};
}

/// Places of words in a list.
class Places {
 public:
  explicit Places(const std::vector<std::string>& words) {
    for (std::size_t n = 0; n < words.size(); ++n) places_.emplace(words[n], n);
  }
  std::size_t of(const std::string& word) const { return places_.at(word); }

 private:
  std::unordered_map<std::string, std::size_t> places_;
};

Json space_json(const Space& space) {
  const Places kinds(space.kinds);
  const Places states(space.states);
  const Places commands(space.commands);
  Json met = Json::array();
  for (const auto& [where, cell] : space.cells) {
    const auto& [kind, state, command] = where;
    met.push_back(Json::array(
        {kinds.of(kind), states.of(state), commands.of(command), cell.cases, cell.failures}));
  }
  return {{"kinds", space.kinds},         {"states", space.states}, {"commands", space.commands},
          {"combinations", space.size()}, {"holes", space.holes()}, {"met", std::move(met)}};
}

Json case_columns() {
  return {"number",  "generation", "kind",       "outcome",  "fault_at_s", "first_effect_s",
          "drive_s", "host_s",     "violated_s", "violated", "margin",     "state",
          "command", "note",       "real_time",  "runs",     "flips",      "values"};
}

Json case_row(const CaseResult& result, std::optional<std::size_t> kind) {
  Json values = Json::array();
  for (const auto& value : result.values) {
    if (!value) {
      values.push_back(nullptr);
    } else if (const auto* const number = std::get_if<double>(&*value)) {
      values.push_back(*number);
    } else {
      values.push_back(std::get<std::string>(*value));
    }
  }
  return Json::array({result.number, result.generation, kind_of(result, kind),
                      outcome_key(result.outcome), seconds_json(result.fault_at),
                      seconds_json(result.first_effect_at), seconds_json(result.detected_by_drive),
                      seconds_json(result.detected_by_host), seconds_json(result.violated_at),
                      result.violated, optional_json(result.margin), result.state, result.command,
                      note_of(result), result.real_time, result.runs, result.flips,
                      std::move(values)});
}

Json residual_json(const Answer& answer) {
  const auto kind = kind_dimension(answer.head);
  Json rows = Json::array();
  for (const CaseResult& result : answer.residual) rows.push_back(case_row(result, kind));
  return {{"columns", case_columns()},
          {"rows", std::move(rows)},
          {"left_out", answer.residual_left_out}};
}

Json smallest_json(const Answer& answer) {
  Json list = Json::array();
  for (const SmallestCase& one : answer.smallest) {
    list.push_back({{"kind", one.kind},
                    {"outcome", outcome_key(one.outcome)},
                    {"command", one.command},
                    {"case", case_row(one.result, kind_dimension(answer.head))},
                    {"svg", one.svg}});
  }
  return list;
}

Json thresholds_json(const std::vector<ThresholdResult>& thresholds) {
  Json list = Json::array();
  for (const ThresholdResult& one : thresholds) {
    list.push_back({{"text", one.text},
                    {"holds", one.holds},
                    {"measured", optional_json(one.measured)},
                    {"missing", one.missing}});
  }
  return list;
}

Json comparison_object(const Comparison& comparison) {
  Json moves = Json::array();
  for (const OutcomeCounts& row : comparison.moves) moves.push_back(row);
  Json rows = Json::array();
  const auto kind = kind_dimension(comparison.now);
  for (const WorseCase& one : comparison.cases) {
    rows.push_back({{"before", outcome_key(one.before)}, {"case", case_row(one.now, kind)}});
  }
  return {{"worse", comparison.worse},
          {"better", comparison.better},
          {"same", comparison.same},
          {"not_fired", comparison.not_fired},
          {"only_before", comparison.only_before},
          {"only_now", comparison.only_now},
          {"before",
           {{"version", comparison.before.version}, {"input_hash", comparison.before.input_hash}}},
          {"moves", std::move(moves)},
          {"columns", case_columns()},
          {"cases", std::move(rows)},
          {"left_out", comparison.cases_left_out}};
}

Json outcome_keys() {
  Json keys = Json::array();
  for (std::size_t n = 0; n < kCaseOutcomes; ++n) {
    keys.push_back(outcome_key(static_cast<CaseOutcome>(n)));
  }
  return keys;
}

}  // namespace

std::string answer_json(const Answer& answer, const std::vector<ThresholdResult>& thresholds,
                        const Comparison* comparison) {
  Json kinds = Json::array();
  for (const KindAnswer& one : answer.kinds) kinds.push_back(kind_json(one));
  const std::string command = answer.command_of(0);
  Json json = {{"type", "campaign"},
               {"campaign", campaign_json(answer.head)},
               {"case_command", command.substr(0, command.size() - 1)},
               {"outcomes", outcome_keys()},
               {"real_time", answer.real_time},
               {"flipped", answer.flipped},
               {"all", kind_json(answer.all)},
               {"kinds", std::move(kinds)},
               {"space", answer.space.size() > 0 ? space_json(answer.space) : Json(nullptr)},
               {"required", thresholds_json(thresholds)},
               {"smallest", smallest_json(answer)},
               {"residual", residual_json(answer)}};
  if (comparison) json["comparison"] = comparison_object(*comparison);
  return json_line(json);
}

std::string comparison_json(const Comparison& comparison) {
  Json json = {{"type", "comparison"}, {"outcomes", outcome_keys()}};
  json.update(comparison_object(comparison));
  return json_line(json);
}

}  // namespace lk::emulator
