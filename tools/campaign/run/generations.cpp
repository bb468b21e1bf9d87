#include "tools/campaign/run/generations.hpp"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "emulator/ground/start_error.hpp"
#include "tools/campaign/plan/adaptive.hpp"
#include "tools/campaign/run/interruption.hpp"

namespace lk::emulator {
namespace {

/// A generation on its way: its cases, and what is known of them.
struct Generation {
  std::vector<CaseToRun> cases;
  std::vector<std::optional<CaseResult>> results;

  std::vector<CaseToRun> left() const {
    std::vector<CaseToRun> left;
    for (std::size_t n = 0; n < cases.size(); ++n) {
      if (!results[n]) left.push_back(cases[n]);
    }
    return left;
  }
  void take(const CaseResult& result) { results[result.number - cases.front().number] = result; }
};

class AdaptiveRun {
 public:
  AdaptiveRun(const Plan& plan, CampaignStore& store, const CampaignOptions& options)
      : plan_(plan), store_(store), options_(options), sampler_(plan) {}

  std::uint64_t run(const std::function<CaseRunner()>& runner, CampaignProgress& progress) {
    const std::uint64_t generations = generations_of(plan_);
    const bool shard = options_.shard.of > 1;
    const std::uint64_t last = shard ? options_.shard.index + 1 : generations;
    for (std::uint64_t g = 0; g < last; ++g) {
      Generation generation = next(g);
      const std::vector<CaseToRun> left = generation.left();
      if (!left.empty() && shard && g + 1 < last) {
        throw StartError("--after: has no results of generation " + std::to_string(g + 1) + " of " +
                         std::to_string(generations));
      }
      run_cases(left, runner, generation, progress);
      if (interrupted()) break;
      learn(generation);
    }
    return ran_;
  }

 private:
  Generation next(std::uint64_t g) {
    Generation generation;
    for (CaseValues& values : sampler_.next()) {
      const std::uint64_t number = g * AdaptiveSampler::kGeneration + generation.cases.size();
      if (number >= plan_.head.numbers) break;
      generation.cases.push_back({number, static_cast<std::uint32_t>(g + 1), std::move(values)});
      auto known = store_.find(number);
      if (!known && options_.earlier != nullptr) known = options_.earlier->find(number);
      generation.results.push_back(std::move(known));
    }
    return generation;
  }
  void run_cases(const std::vector<CaseToRun>& left, const std::function<CaseRunner()>& runner,
                 Generation& generation, CampaignProgress& progress) {
    if (left.empty()) return;
    const auto jobs = static_cast<std::size_t>(options_.jobs);
    const std::size_t pile = plan_.host ? 1 : (left.size() + jobs - 1) / jobs;
    std::size_t taken = 0;
    run_in_threads(
        options_.jobs, runner,
        [&] {
          const std::size_t first = std::exchange(taken, std::min(taken + pile, left.size()));
          return std::vector<CaseToRun>(left.begin() + static_cast<std::ptrdiff_t>(first),
                                        left.begin() + static_cast<std::ptrdiff_t>(taken));
        },
        [&](const std::vector<CaseResult>& results) {
          store_.put(results);
          for (const CaseResult& result : results) generation.take(result);
          ran_ += results.size();
          progress.show(ran_);
        },
        interrupted);
  }
  void learn(const Generation& generation) {
    std::vector<CaseResult> results;
    for (const auto& result : generation.results) results.push_back(*result);
    sampler_.learn(results);
  }

  const Plan& plan_;
  CampaignStore& store_;
  const CampaignOptions& options_;
  AdaptiveSampler sampler_;
  std::uint64_t ran_ = 0;
};

}  // namespace

std::uint64_t generations_of(const Plan& plan) {
  return (plan.head.numbers + AdaptiveSampler::kGeneration - 1) / AdaptiveSampler::kGeneration;
}

std::uint64_t run_generations(const Plan& plan, CampaignStore& store,
                              const CampaignOptions& options,
                              const std::function<CaseRunner()>& runner,
                              CampaignProgress& progress) {
  return AdaptiveRun(plan, store, options).run(runner, progress);
}

}  // namespace lk::emulator
