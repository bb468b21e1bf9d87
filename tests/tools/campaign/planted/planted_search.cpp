// How many cases it takes to find the planted bugs: planted_search SEEDS MOST [BUG…] runs each bug
// with SEEDS seeds, as `random` and as `adaptive` draw cases, until one fails or MOST have been
// run, and tells the medians and every count.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "emulator/config/config_reader.hpp"
#include "tests/tools/campaign/planted/planted_case.hpp"
#include "tools/campaign/plan/adaptive.hpp"
#include "tools/campaign/plan/plan_dimensions.hpp"
#include "tools/campaign/plan/sampling.hpp"

namespace lk::emulator::planted {
namespace {

/// The dimensions of a bug as a plan has them.
std::string toml_of(const Bug& bug) {
  std::string text;
  for (const Dimension& dimension : bug.dimensions) {
    text += '"' + dimension.name + "\" = ";
    if (!dimension.words.empty()) {
      text += '[';
      for (const std::string& word : dimension.words) text += '"' + word + "\", ";
      text += "]\n";
    } else if (!dimension.numbers.empty()) {
      text += '[';
      for (const double number : dimension.numbers) text += value_text(number) + ", ";
      text += "]\n";
    } else {
      text +=
          "{ from = " + value_text(dimension.from) + ", to = " + value_text(dimension.to) + " }\n";
    }
  }
  return text;
}

emulator::Plan plan_of(const Bug& bug, Sampling sampling, std::uint64_t seed) {
  emulator::Plan plan;
  plan.head.sampling = sampling;
  plan.head.seed = seed;
  const toml::table table = parse_toml(toml_of(bug), bug.name);
  plan.dimensions = read_dimensions(table, bug.name, {});
  return plan;
}

CaseResult run_case(const Bug& bug, const Scenario& base, const emulator::Plan& plan,
                    const CaseValues& values) {
  Values named;
  for (std::size_t n = 0; n < values.size(); ++n) {
    if (!values[n]) continue;
    const auto whole = std::ranges::find(bug.dimensions, plan.dimensions[n].name, &Dimension::name);
    const double* const number = std::get_if<double>(&*values[n]);
    named[plan.dimensions[n].name] =
        number != nullptr && whole->whole ? CaseValue(std::round(*number)) : *values[n];
  }
  const PlantedCase one = case_of(base, named);
  const PlantedRun run = bug.run(one.scenario, one.host);
  CaseResult result;
  result.outcome = run.failed  ? CaseOutcome::kSilentlyWrong
                   : run.fired ? CaseOutcome::kTolerated
                               : CaseOutcome::kNotFired;
  result.margin = run.margin;
  return result;
}

/// Cases up to and with the first that fails; `most` where none did.
std::size_t search(const Bug& bug, Sampling sampling, std::uint64_t seed, std::size_t most) {
  const Scenario base = base_scenario(bug);
  const emulator::Plan plan = plan_of(bug, sampling, seed);
  AdaptiveSampler sampler(plan);
  for (std::size_t count = 0; count < most;) {
    std::vector<CaseValues> cases;
    if (sampling == Sampling::kAdaptive) {
      cases = sampler.next();
    } else {
      cases.push_back(random_values(plan, count));
    }
    std::vector<CaseResult> results;
    for (const CaseValues& values : cases) {
      results.push_back(run_case(bug, base, plan, values));
      if (++count; results.back().outcome == CaseOutcome::kSilentlyWrong) return count;
    }
    sampler.learn(results);
  }
  return most;
}

std::size_t print_line(const Bug& bug, Sampling sampling, std::uint64_t seeds, std::size_t most) {
  std::vector<std::size_t> counts;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    counts.push_back(search(bug, sampling, seed, most));
  }
  std::ranges::sort(counts);
  const std::size_t median = counts[counts.size() / 2];
  std::printf("%-28s %-8s median %6zu:", bug.name.c_str(),
              std::string(kSamplingWords[static_cast<std::size_t>(sampling)]).c_str(), median);
  for (const std::size_t count : counts) std::printf(" %zu", count);
  std::printf("\n");
  std::fflush(stdout);
  return median;
}

int run(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: planted_search SEEDS MOST [BUG...]\n");
    return 2;
  }
  const auto seeds = std::strtoull(argv[1], nullptr, 10);
  const auto most = std::strtoull(argv[2], nullptr, 10);
  const std::vector<std::string> wanted(argv + 3, argv + argc);
  for (const Bug& bug : all_bugs()) {
    if (!wanted.empty() && std::ranges::find(wanted, bug.name) == wanted.end()) continue;
    const double random = static_cast<double>(print_line(bug, Sampling::kRandom, seeds, most));
    const double adaptive = static_cast<double>(print_line(bug, Sampling::kAdaptive, seeds, most));
    std::printf("%-28s %s: random / adaptive = %.2f\n", bug.name.c_str(),
                bug.has_gradient ? "gradient" : "no gradient", random / adaptive);
    std::fflush(stdout);
  }
  return 0;
}

}  // namespace
}  // namespace lk::emulator::planted

int main(int argc, char** argv) { return lk::emulator::planted::run(argc, argv); }
