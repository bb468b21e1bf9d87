#include "tools/campaign/plan/adaptive.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>

#include "tests/tools/campaign/plan/plan_support.hpp"
#include "tools/campaign/plan/sampling.hpp"

namespace lk::emulator {
namespace {

constexpr const char* kSpace = R"(
fault.kind = ["jam", "silent", "bridge_dead"]
fault.id = 1
fault.at_s = { from = 0, to = 1 }
supply_V = { from = 0, to = 100 }
ambient_C = { from = 0, to = 100 }
)";

Plan space(int seed) {
  return plan_of("adaptive", kSpace, "cases = 1000\nseed = " + std::to_string(seed));
}

double number(const CaseValues& values, std::size_t dimension) {
  return std::get<double>(*values[dimension]);
}

/// Fails within 0.1 of a corner of the last kind: 1/3 · 4/3 · π · 0.1³ / 8, 1 case in 5,700.
double distance_to_corner(const CaseValues& values) {
  const double at = number(values, 2) - 1;
  const double supply = number(values, 3) / 100 - 1;
  const double ambient = number(values, 4) / 100;
  const double away = std::sqrt(at * at + supply * supply + ambient * ambient);
  return (value_text(*values[0]) == "bridge_dead" ? away : away + 1) - 0.1;
}

std::vector<CaseResult> results_of(const std::vector<CaseValues>& cases,
                                   const std::function<double(const CaseValues&)>& distance) {
  std::vector<CaseResult> results;
  for (const CaseValues& values : cases) {
    CaseResult result;
    result.margin = distance(values);
    result.outcome = *result.margin < 0 ? CaseOutcome::kSilentlyWrong : CaseOutcome::kTolerated;
    results.push_back(result);
  }
  return results;
}

std::size_t cases_until_failure(int seed) {
  const Plan plan = space(seed);
  AdaptiveSampler sampler(plan);
  for (std::size_t count = 0; count < 2000;) {
    const auto results = results_of(sampler.next(), distance_to_corner);
    for (const CaseResult& result : results) {
      if (++count; result.outcome == CaseOutcome::kSilentlyWrong) return count;
    }
    sampler.learn(results);
  }
  return 2000;
}

// Random cases would need 4,000 in the median.
TEST(AdaptiveSampling, FollowsAMarginThatLeadsToAFailure) {
  std::vector<std::size_t> counts;
  for (int seed = 1; seed <= 9; ++seed) counts.push_back(cases_until_failure(seed));
  std::ranges::sort(counts);
  EXPECT_LE(counts[4], 200U);
  EXPECT_LE(counts[8], 1000U);
}

TEST(AdaptiveSampling, GivesTheSameCasesForTheSameResults) {
  const Plan plan = space(1);
  AdaptiveSampler one(plan);
  AdaptiveSampler other(plan);
  for (int generation = 0; generation < 6; ++generation) {
    const std::vector<CaseValues> cases = one.next();
    EXPECT_EQ(cases, other.next());
    one.learn(results_of(cases, distance_to_corner));
    other.learn(results_of(cases, distance_to_corner));
  }
}

// Where nothing tells, five in six cases or more are those that `random` would have drawn.
TEST(AdaptiveSampling, DrawsEvenlyWhereMarginsTellNothing) {
  const Plan plan = space(3);
  AdaptiveSampler sampler(plan);
  std::size_t drawn = 0;
  constexpr std::size_t kGenerations = 60;
  for (std::size_t generation = 0; generation < kGenerations; ++generation) {
    const std::vector<CaseValues> cases = sampler.next();
    for (std::size_t n = 0; n < cases.size(); ++n) {
      drawn += cases[n] == random_values(plan, generation * cases.size() + n) ? 1U : 0U;
    }
    sampler.learn(results_of(cases, [](const CaseValues&) { return 0.49; }));
  }
  EXPECT_GE(drawn * 6, kGenerations * AdaptiveSampler::kGeneration * 5);
}

TEST(AdaptiveSampling, LearnsNothingFromFaultsThatDidNotFire) {
  const Plan plan = space(2);
  AdaptiveSampler sampler(plan);
  for (int generation = 0; generation < 3; ++generation) {
    const std::vector<CaseValues> cases = sampler.next();
    for (std::size_t n = 0; n < cases.size(); ++n) {
      EXPECT_EQ(cases[n], random_values(plan, static_cast<std::uint64_t>(generation) * 8 + n));
    }
    std::vector<CaseResult> results = results_of(cases, [](const CaseValues&) { return 0.1; });
    for (CaseResult& result : results) result.outcome = CaseOutcome::kNotFired;
    sampler.learn(results);
  }
}

}  // namespace
}  // namespace lk::emulator
