#include "tools/commands/campaign_actions.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cstdio>
#include <functional>
#include <optional>

#include "emulator/files/output_file.hpp"
#include "emulator/ground/start_error.hpp"
#include "emulator/ground/text.hpp"
#include "emulator/scenario/csv_options.hpp"
#include "emulator/scenario/scenario_report.hpp"
#include "emulator/scenario/scenario_runner.hpp"
#include "tools/campaign/hosts/run_host.hpp"
#include "tools/cases/case_files.hpp"
#include "tools/campaign/plan/plan_check.hpp"
#include "tools/campaign/plan/sampling.hpp"
#include "tools/campaign/report/answer_json.hpp"
#include "tools/campaign/report/answer_junit.hpp"
#include "tools/campaign/report/answer_page.hpp"
#include "tools/campaign/report/answer_text.hpp"
#include "tools/campaign/results/case_rows.hpp"
#include "tools/campaign/results/same_campaign.hpp"
#include "tools/campaign/run/host_runner.hpp"
#include "tools/campaign/run/interruption.hpp"
#include "tools/campaign/run/smallest.hpp"
#include "tools/commands/campaign_files.hpp"

namespace lk::emulator {
namespace {

namespace fs = std::filesystem;

/// The results of a part of this campaign.
CampaignStore read_same(const fs::path& file, const Plan& plan) {
  CampaignStore store = CampaignStore::read(file);
  if (const auto otherwise = difference(store.head(), plan.head)) {
    throw StartError(on_one_line(file.string()) + ": " + *otherwise);
  }
  return store;
}

CaseValues values_of(const Plan& plan, std::uint64_t number, const fs::path& store) {
  if (plan.head.sampling == Sampling::kAdaptive) {
    // They depend on what became of others: the store has them.
    const auto result = read_same(store, plan).find(number);
    if (result) return result->values;
    throw StartError(on_one_line(store.string()) + ": has no case " + std::to_string(number));
  }
  const CaseNumbers numbers(plan);
  const std::string name = plan.file.string() + ": ";
  if (number >= numbers.numbers()) {
    throw StartError(name + "has no case " + std::to_string(number) + "; they are 0 to " +
                     std::to_string(numbers.numbers() - 1));
  }
  auto values = numbers.values(number);
  if (!values) throw StartError(name + "case " + std::to_string(number) + " is excluded");
  return *values;
}

/// Puts "fault.for_s=0.1" into the values of a case.
void set_value(const Plan& plan, const std::string& text, CaseValues& values) {
  const std::string name = text.substr(0, text.find('='));
  const auto found = std::ranges::find(plan.dimensions, name, &Dimension::name);
  if (found == plan.dimensions.end() || name.size() == text.size()) {
    throw StartError("--set: \"" + on_one_line(text) +
                     "\" is no NAME=VALUE of this plan's dimensions");
  }
  const std::string given = text.substr(name.size() + 1);
  auto& value = values[static_cast<std::size_t>(found - plan.dimensions.begin())];
  if (found->values.has_words()) {
    const auto& words = found->values.values();
    if (std::ranges::find(words, CaseValue(given)) == words.end()) {
      throw StartError("--set: " + name + " never is \"" + on_one_line(given) + "\" in this plan");
    }
    value = given;
    return;
  }
  double number = 0;
  const auto [end, error] = std::from_chars(given.data(), given.data() + given.size(), number);
  const bool whole = error == std::errc() && end == given.data() + given.size();
  if (!whole || number < found->values.least() || number > found->values.most()) {
    throw StartError("--set: " + name + " is a number from " + value_text(found->values.least()) +
                     " to " + value_text(found->values.most()));
  }
  value = number;
}

/// The values of a case with what --set says in their place.
CaseValues with_set(const Plan& plan, CaseValues values, const std::vector<std::string>& set) {
  if (set.empty()) return values;
  for (const std::string& text : set) set_value(plan, text, values);
  const FaultRow* const kind = kind_of(plan, values);  // another one has other parameters
  for (std::size_t n = 0; n < values.size(); ++n) {
    if (!applies(plan.dimensions[n], kind)) {
      values[n].reset();
    } else if (!values[n]) {
      throw StartError("--set: such a case needs " + plan.dimensions[n].name + " too");
    }
  }
  if (is_excluded(plan, values)) throw StartError("--set: the plan excludes such a case");
  return values;
}

/// Makes runners for threads: of scenarios, or of the plan's host program.
std::function<CaseRunner()> runner_of(const Plan& plan, HostReferences& references) {
  if (!plan.host) {
    return [&plan] {
      return [runner = std::make_shared<OfflineRunner>(plan)](std::span<const CaseToRun> cases,
                                                              const ResultTaker& take) {
        runner->run(cases, take);
      };
    };
  }
  return [&plan, &references] {
    return [runner = std::make_shared<HostRunner>(plan, references, interruption())](
               std::span<const CaseToRun> cases, const ResultTaker& take) {
      take(runner->run(cases));
    };
  };
}

/// A few, spread over all of them; where one is excluded, the next that is not.
std::vector<CaseToRun> spread_cases(const Plan& plan, std::uint64_t most) {
  const CaseNumbers numbers(plan);
  const std::uint64_t count = std::min(most, numbers.numbers());
  std::uint64_t looks = 1'000'000;
  std::vector<CaseToRun> cases;
  std::uint64_t number = 0;
  for (std::uint64_t n = 0; n < count; ++n) {
    number = std::max(number, numbers.numbers() / count * n);
    for (; number < numbers.numbers() && looks > 0; ++number, --looks) {
      auto values = numbers.values(number);
      if (!values) continue;
      cases.push_back({number++, 0, std::move(*values)});
      break;
    }
  }
  if (cases.empty()) throw StartError(plan.file.string() + ": exclude: leaves no case to be found");
  return cases;
}

/// What a plan is wrong with that only a case shows, before anything is written.
void check_plan(const Plan& plan, HostReferences& references) {
  check_ends(plan);
  if (!plan.host) return;
  const CaseToRun first = spread_cases(plan, 1).at(0);
  HostCase settings;
  settings.host_values = host_values(plan, first.values);
  check_host(host_setup(plan), settings);
  const Interruptible interruptible;
  HostRunner(plan, references, interruption()).try_without_fault(first);
}

/// Later generations of `adaptive` need what became of earlier ones.
void check_shard(const Plan& plan, const CampaignRequest& request) {
  const Shard& shard = request.options.shard;
  const bool adaptive = plan.head.sampling == Sampling::kAdaptive;
  if (!adaptive && !request.after.empty()) {
    throw StartError("--after: belongs to shards of adaptive");
  }
  if (!adaptive || shard.of == 1) return;
  const std::uint64_t generations = generations_of(plan);
  if (shard.of != generations) {
    throw StartError("--shard: a shard of adaptive is one generation, and this plan has " +
                     std::to_string(generations) + ": 0/" + std::to_string(generations) +
                     " is the first");
  }
  if (shard.index > 0 && request.after.empty()) {
    throw StartError("--shard: generation " + std::to_string(shard.index + 1) +
                     " depends on those before; --after FILE has their merged results");
  }
}

/// Results that are there already are not written over.
void check_store(const CampaignRequest& request) {
  if (request.resume || !fs::exists(request.store)) return;
  throw StartError(on_one_line(request.store.string()) +
                   ": is there already; --resume goes on with it, -o FILE begins another");
}

/// Where results go: a new file, or one that is gone on with.
CampaignStore store_of(const Plan& plan, const CampaignRequest& request) {
  return fs::exists(request.store) ? CampaignStore::resume(request.store, plan.head)
                                   : CampaignStore::create(request.store, plan.head);
}

CaseStream stream_of(const CampaignStore& store) {
  return [&store](const std::function<void(const CaseResult&)>& take) { store.for_each(take); };
}

/// What is required, checked before anything is run that may take a night.
std::vector<Threshold> thresholds_of(const CampaignReports& reports, const CampaignHead& head) {
  std::vector<Threshold> thresholds;
  for (const std::string& text : reports.require) thresholds.push_back(parse_threshold(text));
  check_thresholds(answer_of(head, [](const auto&) {}), thresholds);
  return thresholds;
}

/// Says and writes what came of a campaign. `complete` adds what only its plan can.
int report_of(const CampaignStore& store, const CampaignReports& reports, bool quiet,
              const std::function<void(Answer&)>& complete) {
  Answer answer = answer_of(store.head(), stream_of(store));
  answer.store_file = store.path().string();
  answer.missing = missing_cases(store.head(), store.count());
  if (!reports.html.empty() || !reports.json.empty()) complete(answer);
  const auto required = check_thresholds(answer, thresholds_of(reports, store.head()));
  if (!quiet) std::fputs(answer_text(answer, required).c_str(), stdout);
  if (!reports.html.empty()) write_output(reports.html, "--html", answer_page(answer, required));
  if (!reports.json.empty()) write_output(reports.json, "--json", answer_json(answer, required));
  if (!reports.junit.empty()) write_output(reports.junit, "--junit", answer_junit(answer));
  const bool holds = std::ranges::all_of(required, &ThresholdResult::holds);
  if (quiet) {
    for (const ThresholdResult& one : required) {
      if (!one.holds) std::printf("%s\n", threshold_sentence(one).c_str());
    }
  }
  return holds ? 0 : 1;
}

std::string dimension_text(const Dimension& dimension) {
  const DimensionValues& set = dimension.values;
  if (!set.is_listed()) {
    return fmt::format("{} to {}", value_text(set.least()), value_text(set.most()));
  }
  constexpr std::size_t kShown = 8;
  std::string text = fmt::format("{}: ", set.size());
  for (std::size_t n = 0; n < std::min(set.size(), kShown); ++n) {
    text += (n > 0 ? ", " : "") + value_text(set.values()[n]);
  }
  return text + (set.size() > kShown ? ", …" : "");
}

std::string time_words(double seconds) {
  if (seconds < 120) return fmt::format("{:.3g} s", seconds);
  if (seconds < 7200) return fmt::format("{:.3g} min", seconds / 60);
  return fmt::format("{:.3g} h", seconds / 3600);
}

/// What a run of the case is to write.
RunOutputs run_outputs(const CaseOutputs& outputs) {
  RunOutputs run;
  if (!outputs.csv.empty()) {
    RunOutputs::Csv csv;
    csv.file = outputs.csv;
    csv.period = row_period(outputs.rate_Hz);
    if (!outputs.signals.empty()) csv.signals = outputs.signals;
    run.csv = csv;
  }
  if (!outputs.candump.empty()) run.frames.candump = outputs.candump;
  return run;
}

}  // namespace

int show_case(const Plan& plan, std::uint64_t number, const fs::path& store,
              const CaseOutputs& outputs) {
  const RunOutputs run = run_outputs(outputs);
  if (plan.host && (!outputs.csv.empty() || !outputs.candump.empty())) {
    throw StartError(std::string(outputs.csv.empty() ? "--candump" : "--csv") +
                     ": not of a case with a host program; --scenario FILE writes the case, and "
                     "lk-emu run FILE what drives do in it without the host");
  }
  const CaseToRun one{number, 0, with_set(plan, values_of(plan, number, store), outputs.set)};
  CaseScenarios scenarios(plan);
  const std::string text = scenarios.file_text(one.values, false);
  CaseFiles files(plan.scenario_file.parent_path());
  std::optional<Scenario> watched;
  if (run.csv || run.frames.candump) {
    watched = parse_scenario(text, plan.scenario_file.string(), std::nullopt, files.files());
    // What it does not have is refused before anything is written.
    if (run.csv) find_signals(run.csv->signals, watched->robot.front().body_signals.get());
  }
  if (!outputs.scenario.empty()) write_output(outputs.scenario, "--scenario", text);
  HostReferences references;
  std::vector<CaseResult> results;
  runner_of(plan, references)()(std::span<const CaseToRun>(&one, 1),
                                [&](std::vector<CaseResult> some) {
                                  results = std::move(some);
                                  return true;
                                });
  if (results.empty()) return 130;
  std::printf("%s\n", case_sentence(results.front(), plan.head).c_str());
  if (!watched) return 0;
  std::fputs(report_text(run_scenario(*std::move(watched), run), false, Language::kEnglish).c_str(),
             stdout);
  return 0;
}

int tell_cost(const Plan& plan, int jobs) {
  HostReferences references;
  check_plan(plan, references);
  const auto sampling = kSamplingWords[static_cast<std::size_t>(plan.head.sampling)];
  std::printf("%s: %lu cases, sampling %s, scenario %s\n", plan.head.plan_name.c_str(),
              static_cast<unsigned long>(plan.head.cases), std::string(sampling).c_str(),
              plan.scenario_file.filename().c_str());
  if (plan.head.cases < plan.head.numbers) {
    std::printf("  %lu more are excluded\n",
                static_cast<unsigned long>(plan.head.numbers - plan.head.cases));
  }
  for (const Dimension& dimension : plan.dimensions) {
    std::printf("  %-36s %s\n", dimension.name.c_str(), dimension_text(dimension).c_str());
  }
  constexpr std::uint64_t kTried = 64;
  const std::vector<CaseToRun> some =
      spread_cases(plan, plan.host ? static_cast<std::uint64_t>(jobs) : kTried);
  const auto began = std::chrono::steady_clock::now();
  runner_of(plan, references)()(some, [](const auto&) { return true; });
  const double each_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count() /
      static_cast<double>(some.size());
  std::printf("about %.3g cases/s for each of %d jobs (%zu tried): %s\n", 1 / each_s, jobs,
              some.size(),
              time_words(each_s * static_cast<double>(plan.head.cases) / jobs).c_str());
  return 0;
}

int run_and_report(const Plan& plan, const CampaignRequest& request) {
  check_shard(plan, request);
  check_store(request);
  check_reports(request.reports, {{request.store, "the file of the results"},
                                  {request.after, "the file of --after"},
                                  {plan.file, "the plan"},
                                  {plan.scenario_file, "the plan's scenario"}});
  thresholds_of(request.reports, plan.head);
  CampaignOptions options = request.options;
  std::optional<CampaignStore> earlier;
  if (!request.after.empty()) {
    earlier = read_same(request.after, plan);
    options.earlier = &*earlier;
  }
  HostReferences references;
  check_plan(plan, references);
  CampaignStore store = store_of(plan, request);
  const CampaignEnd end = run_campaign(plan, store, options, runner_of(plan, references));
  const std::string name = on_one_line(request.store.string());
  if (end.interrupted) {
    std::fprintf(stderr, "lk-emu: stopped after %lu cases, all kept in %s; %s goes on\n",
                 static_cast<unsigned long>(end.before + end.ran), name.c_str(),
                 request.resuming.c_str());
    return 130;
  }
  if (!request.quiet) {
    std::printf("%s: %lu cases in %s, %.3g/s; %s\n", plan.head.plan_name.c_str(),
                static_cast<unsigned long>(end.ran), time_words(end.wall_s).c_str(),
                static_cast<double>(end.ran) / std::max(end.wall_s, 1e-9), name.c_str());
  }
  return report_of(store, request.reports, request.quiet, [&](Answer& answer) {
    const Interruptible interruptible;
    if (!plan.host) {
      answer.smallest = smallest_cases(plan, answer, request.options.jobs, interrupted);
    }
    if (!interrupted()) return;
    std::fprintf(stderr, "lk-emu: stopped: all cases are in %s, smallest cases are missing; %s\n",
                 name.c_str(), (request.resuming + " looks for them again").c_str());
  });
}

int report_results(const fs::path& store, const CampaignReports& reports, bool quiet) {
  check_reports(reports, {{store, "the file of the results"}});
  return report_of(CampaignStore::read(store), reports, quiet, [](Answer&) {});
}

int compare_results(const fs::path& before, const fs::path& now, const CampaignReports& reports) {
  check_reports(reports, {{before, "the file of results before"}, {now, "the file of results"}});
  const CampaignStore old_store = CampaignStore::read(before);
  const CampaignStore new_store = CampaignStore::read(now);
  CaseCursor old_cases = old_store.cursor();
  CaseCursor new_cases = new_store.cursor();
  const Comparison comparison = compare_campaigns(
      old_store.head(), [&] { return old_cases.next(); }, new_store.head(),
      [&] { return new_cases.next(); });
  const Answer answer = answer_of(new_store.head(), stream_of(new_store));
  std::fputs(comparison_text(comparison, answer.plan_file).c_str(), stdout);
  if (!reports.html.empty()) {
    write_output(reports.html, "--html", answer_page(answer, {}, &comparison));
  }
  if (!reports.json.empty()) write_output(reports.json, "--json", comparison_json(comparison));
  return comparison.is_worse() ? 1 : 0;
}

}  // namespace lk::emulator
