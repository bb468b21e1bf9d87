#include "tools/campaign/run/smallest.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <map>
#include <memory>
#include <sstream>
#include <thread>
#include <tuple>
#include <utility>

#include "emulator/core/scenario/sampler.hpp"
#include "emulator/scenario/csv_options.hpp"
#include "emulator/scenario/csv_writer.hpp"
#include "tools/cases/case_files.hpp"
#include "tools/campaign/plan/case_scenario.hpp"
#include "tools/campaign/run/campaign_run.hpp"
#include "tools/plot/run_picture.hpp"
#include "tools/plot/svg.hpp"

namespace lk::emulator {
namespace {

constexpr int kAtOnce = 8;  // values that are tried in one bank

bool is_severity(const Dimension& dimension) {
  const bool of_severity = dimension.target == Target::kFaultFor ||
                           dimension.target == Target::kFaultProbability ||
                           dimension.target == Target::kFaultParam;
  return of_severity && !dimension.values.has_words();
}

/// Values from the harmless end up to `present`, that not among them; at most kAtOnce.
std::vector<double> milder(const Dimension& dimension, double present) {
  const DimensionValues& values = dimension.values;
  std::vector<double> all;
  if (values.is_listed()) {
    for (const CaseValue& value : values.values()) all.push_back(std::get<double>(value));
    std::ranges::sort(all);
    if (dimension.least_is_to) std::ranges::reverse(all);
    all.erase(std::ranges::find(all, present), all.end());
    if (all.size() > kAtOnce) all.resize(kAtOnce);
    return all;
  }
  const double end = dimension.least_is_to ? 1 : 0;
  const double place = values.place_of(present);
  for (int n = 0; n < kAtOnce; ++n) {
    const double share = end + (place - end) * n / kAtOnce;
    const double value =
        std::get<double>(values.quantile(std::clamp(share, 0.0, std::nextafter(1.0, 0.0))));
    if (value != present && (all.empty() || all.back() != value)) all.push_back(value);
  }
  return all;
}

/// The mildest of `tried`, values of `dimension`, with the outcome of `present`; `present`: none.
CaseResult mildest(const Plan& plan, OfflineRunner& runner, const CaseResult& present,
                   std::size_t dimension, const std::vector<double>& tried) {
  std::vector<CaseToRun> cases;
  for (std::size_t n = 0; n < tried.size(); ++n) {
    CaseToRun one{n, present.generation, present.values};
    one.values[dimension] = tried[n];
    if (!is_excluded(plan, one.values)) cases.push_back(std::move(one));
  }
  for (CaseResult& result : runner.run(cases)) {
    if (result.outcome != present.outcome) continue;
    result.number = present.number;
    return result;
  }
  return present;
}

std::string csv_of(const Scenario& scenario) {
  const std::vector<const Signal*> signals =
      find_signals({"angle_deg", "true_angle_deg", "speed_dps", "iq_A", "temperature_C"}, nullptr);
  std::vector<std::string> buses;
  std::vector<Sampler> samplers;
  for (const BusConfig& bus : scenario.robot) {
    std::vector<SampledColumn> columns;
    for (const ServoConfig& servo : bus.servos) {
      for (const Signal* signal : signals) columns.push_back({servo.id, signal});
    }
    constexpr SimTime kPeriod = std::chrono::milliseconds(20);
    samplers.emplace_back(std::move(columns), SimTime{0}, kPeriod);
    buses.push_back(bus.interface);
  }
  std::string text = csv_header(buses, samplers);
  ScenarioRun run(scenario);
  std::vector<double> row;
  std::vector<double> values;
  std::vector<Traffic> unheard;
  while (samplers.front().next_due() <= scenario.duration) {
    run.advance_to(samplers.front().next_due());
    unheard.clear();
    run.take_traffic(unheard);
    values.clear();
    for (std::size_t n = 0; n < samplers.size(); ++n) {
      samplers[n].look(run.bus(n), row);
      values.insert(values.end(), row.begin(), row.end());
    }
    text += csv_row(run.time(), values);
  }
  return text;
}

/// Failures to begin with, one for each kind and outcome: the first that there is.
std::vector<const CaseResult*> first_failures(const Plan& plan, const Answer& answer) {
  std::map<std::pair<std::string, CaseOutcome>, const CaseResult*> first;
  for (const CaseResult& result : answer.residual) {
    const FaultRow* const row = kind_of(plan, result.values);
    if (row != nullptr) first.try_emplace({std::string(row->word), result.outcome}, &result);
  }
  std::vector<const CaseResult*> failures;
  for (const auto& [key, result] : first) failures.push_back(result);
  return failures;
}

SmallestCase smallest_of(const Plan& plan, const Answer& answer, const CaseResult& failing) {
  OfflineRunner runner(plan);
  SmallestCase one;
  one.result = shrunk(plan, runner, failing);
  one.command = command_of(plan, answer, failing, one.result);
  one.kind = kind_of(plan, one.result.values)->word;
  one.outcome = one.result.outcome;
  one.svg = picture_of_case(plan, one.result);
  return one;
}

}  // namespace

CaseResult shrunk(const Plan& plan, OfflineRunner& runner, const CaseResult& failing) {
  constexpr int kRounds = 3;
  CaseResult smallest = failing;
  for (int round = 0; round < kRounds; ++round) {
    const CaseValues before = smallest.values;
    for (std::size_t n = 0; n < plan.dimensions.size(); ++n) {
      if (!smallest.values[n] || !is_severity(plan.dimensions[n])) continue;
      const auto tried = milder(plan.dimensions[n], std::get<double>(*smallest.values[n]));
      if (!tried.empty()) smallest = mildest(plan, runner, smallest, n, tried);
    }
    if (smallest.values == before) break;
  }
  return smallest;
}

std::string command_of(const Plan& plan, const Answer& answer, const CaseResult& failing,
                       const CaseResult& smallest) {
  std::string command = answer.command_of(failing.number);
  for (std::size_t n = 0; n < plan.dimensions.size(); ++n) {
    if (smallest.values[n] == failing.values[n]) continue;
    command += " --set " + plan.dimensions[n].name + '=' + value_text(*smallest.values[n]);
  }
  return command;
}

std::string picture_of_case(const Plan& plan, const CaseResult& result) {
  CaseScenarios scenarios(plan);
  CaseFiles files(plan.scenario_file.parent_path());
  const Scenario scenario =
      parse_scenario(scenarios.file_text(result.values, false), plan.scenario_file.string(),
                     std::nullopt, files.files());
  RunCsv csv(std::make_unique<std::istringstream>(csv_of(scenario)), "case");
  PlottedRows rows;
  const ChosenDrives drives = choose_drives(csv.columns(), {});
  return to_svg(
      picture_of(csv, drives, "case " + std::to_string(result.number), Language::kEnglish, rows));
}

std::vector<SmallestCase> smallest_cases(const Plan& plan, const Answer& answer, int jobs,
                                         const std::function<bool()>& stop) {
  const std::vector<const CaseResult*> failures = first_failures(plan, answer);
  std::vector<std::optional<SmallestCase>> found(failures.size());
  std::atomic<std::size_t> next = 0;
  const auto work = [&] {
    for (std::size_t n = next++; n < failures.size() && !stop(); n = next++) {
      try {
        found[n] = smallest_of(plan, answer, *failures[n]);
      } catch (const std::exception&) {
        // The report is worth more than this case: no memory, or results that somebody changed.
      }
    }
  };
  {
    std::vector<std::jthread> threads;
    start_threads(threads, jobs - 1, work);
    work();
  }
  std::vector<SmallestCase> smallest;
  for (auto& one : found) {
    if (one) smallest.push_back(std::move(*one));
  }
  return smallest;
}

}  // namespace lk::emulator
