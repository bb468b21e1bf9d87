#include "tools/campaign/plan/sampling.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

#include "emulator/config/config_error.hpp"
#include "tests/tools/campaign/plan/plan_support.hpp"

namespace lk::emulator {
namespace {

constexpr const char* kTwoKinds = R"(
fault.kind = ["jam", "kick", "drop"]
fault.id = 1
fault.at_s = [1, 2]
fault.for_s = [0.1, 0.2, 0.5]
fault.jam.percent = [50, 100]
fault.kick.impulse_Nms = [0.1, 0.2, 0.3]
fault.probability = [0.5, 1]
)";

std::vector<std::string> all_of(const Plan& plan) {
  const CaseNumbers numbers(plan);
  std::vector<std::string> all;
  for (std::uint64_t n = 0; n < numbers.numbers(); ++n) {
    if (const auto values = numbers.values(n)) all.push_back(text_of(*values));
  }
  return all;
}

// jam: 2 times × 3 durations × 2 = 12; kick is done at once: 2 × 3 = 6; drop: 2 × 3 × 2 = 12.
TEST(FullSampling, CountsWhatBelongsToEachKind) {
  const Plan plan = plan_of("full", kTwoKinds);
  const std::vector<std::string> all = all_of(plan);
  EXPECT_EQ(all.size(), 30);
  EXPECT_EQ(std::set(all.begin(), all.end()).size(), 30);
  EXPECT_EQ(all[0], "jam 1 1 0.1 50 - -");
  EXPECT_EQ(all[1], "jam 1 1 0.1 100 - -");
  EXPECT_EQ(all[11], "jam 1 2 0.5 100 - -");
  EXPECT_EQ(all[12], "kick 1 1 - - 0.1 -");
  EXPECT_EQ(all[29], "drop 1 2 0.5 - - 1");
}

TEST(FullSampling, KeepsNumbersWhereCasesAreExcluded) {
  const Plan plan = plan_of("full", kTwoKinds, "[[exclude]]\nfault.kind = \"jam\"\nfault.at_s = 1");
  const CaseNumbers numbers(plan);
  EXPECT_EQ(numbers.numbers(), 30);
  EXPECT_EQ(all_of(plan).size(), 24);
  EXPECT_FALSE(numbers.values(0));
  EXPECT_EQ(text_of(*numbers.values(12)), "kick 1 1 - - 0.1 -");
}

TEST(RandomSampling, OfACaseDependsOnSeedAndNumberAlone) {
  const std::string dimensions =
      "fault.kind = \"jam\"\nfault.id = 1\nfault.at_s = { from = 0, to = 4 }";
  const Plan few = plan_of("random", dimensions, "cases = 10");
  const Plan many = plan_of("random", dimensions, "cases = 1000");
  const Plan other = plan_of("random", dimensions, "cases = 10\nseed = 2");
  EXPECT_EQ(text_of(*CaseNumbers(few).values(7)), text_of(*CaseNumbers(many).values(7)));
  EXPECT_NE(text_of(*CaseNumbers(few).values(7)), text_of(*CaseNumbers(other).values(7)));
}

// Of 4,000 draws of two equal words, 2,000 ± 4 · √(4000 / 4) = ±126 are either one; the mean of a
// uniform variable over 0 to 4 is 2 ± 4 · 4/√12/√4000 = ±0.073.
TEST(RandomSampling, FollowsTheDeclaredDistribution) {
  const Plan plan = plan_of("random",
                            "fault.kind = [\"jam\", \"silent\"]\nfault.id = 1\n"
                            "fault.at_s = { from = 0, to = 4 }",
                            "cases = 4000");
  const CaseNumbers numbers(plan);
  int jams = 0;
  double sum = 0;
  for (std::uint64_t n = 0; n < 4000; ++n) {
    const CaseValues values = *numbers.values(n);
    jams += value_text(*values[0]) == "jam" ? 1 : 0;
    sum += std::get<double>(*values[2]);
  }
  EXPECT_NEAR(jams, 2000, 126);
  EXPECT_NEAR(sum / 4000, 2, 0.073);
}

TEST(RandomSampling, DrawsAgainWhatIsExcluded) {
  const Plan plan =
      plan_of("random",
              "fault.kind = [\"jam\", \"silent\"]\nfault.id = 1\n"
              "fault.at_s = { from = 0, to = 4 }",
              "cases = 200\n[[exclude]]\nfault.kind = \"jam\"\nfault.at_s = { from = 1 }");
  const CaseNumbers numbers(plan);
  for (std::uint64_t n = 0; n < 200; ++n) {
    const CaseValues values = *numbers.values(n);
    EXPECT_TRUE(value_text(*values[0]) != "jam" || std::get<double>(*values[2]) < 1);
  }
}

TEST(RandomSampling, SaysWhenExclusionsLeaveNothing) {
  const Plan plan = plan_of("random", "fault.kind = \"jam\"\nfault.id = 1\nfault.at_s = 1",
                            "cases = 2\n[[exclude]]\nfault.kind = \"jam\"");
  EXPECT_THROW(CaseNumbers(plan).values(0), ConfigError);
}

TEST(LatinSampling, MeetsEverySliceOfEveryDimensionOnce) {
  const Plan plan = plan_of("latin",
                            "fault.kind = [\"jam\", \"silent\"]\nfault.id = 1\n"
                            "fault.at_s = { from = 0, to = 4 }\nsupply_V = { from = 20, to = 28 }",
                            "cases = 100");
  const CaseNumbers numbers(plan);
  std::set<int> times;
  std::set<int> supplies;
  int jams = 0;
  for (std::uint64_t n = 0; n < 100; ++n) {
    const CaseValues values = *numbers.values(n);
    jams += value_text(*values[0]) == "jam" ? 1 : 0;
    times.insert(static_cast<int>(std::get<double>(*values[2]) / 0.04));
    supplies.insert(static_cast<int>((std::get<double>(*values[3]) - 20) / 0.08));
  }
  EXPECT_EQ(jams, 50);
  // Rounding may put a draw at a slice's edge into its neighbour.
  EXPECT_GE(times.size(), 97);
  EXPECT_GE(supplies.size(), 97);
}

TEST(PairwiseSampling, LetsAnyTwoValuesMeetInFewCases) {
  const Plan plan =
      plan_of("pairwise",
              "fault.kind = [\"jam\", \"silent\", \"bridge_dead\", \"encoder_stuck\"]\n"
              "fault.id = 1\nfault.at_s = [1, 2, 3]\nfault.for_s = [0.1, 0.2, 0.5]\n"
              "supply_V = [20, 24, 28]\nambient_C = [0, 25, 40]");
  const std::vector<CaseValues> cases = pairwise_cases(plan);
  std::set<std::tuple<std::size_t, std::size_t, std::string, std::string>> met;
  for (const CaseValues& values : cases) {
    for (std::size_t a = 0; a < values.size(); ++a) {
      for (std::size_t b = a + 1; b < values.size(); ++b) {
        met.emplace(a, b, value_text(*values[a]), value_text(*values[b]));
      }
    }
  }
  // Kind (4) with id (1), at, for, supply, ambient (3 each): 4 + 4·12; id with four: 12; the six
  // pairs of threes: 54.
  EXPECT_EQ(met.size(), 4 + 48 + 12 + 54);
  EXPECT_LE(cases.size(), 24);  // 4 · 3 = 12 are the least; twice that is poor
}

TEST(PairwiseSampling, LeavesOutWhatIsExcludedAndWhatBelongsToOthers) {
  const Plan plan =
      plan_of("pairwise", kTwoKinds, "[[exclude]]\nfault.kind = \"jam\"\nfault.at_s = 2");
  const std::vector<CaseValues> cases = pairwise_cases(plan);
  EXPECT_FALSE(cases.empty());
  std::map<std::string, int> with;
  for (const CaseValues& values : cases) {
    const std::string kind = value_text(*values[0]);
    ++with[kind];
    EXPECT_EQ(values[4].has_value(), kind == "jam");
    EXPECT_EQ(values[5].has_value(), kind == "kick");
    EXPECT_FALSE(kind == "jam" && std::get<double>(*values[2]) == 2);
  }
  EXPECT_EQ(with.size(), 3);
}

using MetPairs = std::set<std::tuple<std::size_t, std::size_t, std::string, std::string>>;

void meet(const CaseValues& values, MetPairs& met) {
  for (std::size_t a = 0; a < values.size(); ++a) {
    for (std::size_t b = a + 1; b < values.size(); ++b) {
      if (values[a] && values[b]) met.emplace(a, b, value_text(*values[a]), value_text(*values[b]));
    }
  }
}

// What `full` has, every combination that is not excluded, is what can meet.
void expect_all_possible_pairs(const std::string& dimensions, const std::string& exclusions) {
  const Plan every = plan_of("full", dimensions, exclusions);
  const CaseNumbers numbers(every);
  MetPairs possible;
  std::set<std::string> allowed;
  for (std::uint64_t n = 0; n < numbers.numbers(); ++n) {
    const auto values = numbers.values(n);
    if (!values) continue;
    meet(*values, possible);
    allowed.insert(text_of(*values));
  }
  MetPairs met;
  for (const CaseValues& values : pairwise_cases(plan_of("pairwise", dimensions, exclusions))) {
    EXPECT_TRUE(allowed.contains(text_of(values))) << text_of(values);
    meet(values, met);
  }
  EXPECT_EQ(met, possible) << exclusions;
}

TEST(PairwiseSampling, LosesNoPairThatExclusionsLeavePossible) {
  // The kind that brings most pairs is one that the exclusion forbids.
  expect_all_possible_pairs(
      "fault.kind = [\"jam\", \"cut\"]\nfault.id = 1\nfault.at_s = [1, 2]\n"
      "fault.for_s = [0.1, 0.2]\nfault.jam.percent = 50\n",
      "[[exclude]]\nfault.kind = \"jam\"\nfault.at_s = 1\n");
  expect_all_possible_pairs(kTwoKinds, "[[exclude]]\nfault.kind = \"jam\"\nfault.at_s = 2\n");
  // Narrow: 24 V with jam alone, at 1 s nothing but kick, and no long drop.
  expect_all_possible_pairs(
      std::string(kTwoKinds) + "supply_V = [20, 22, 24]\n",
      "[[exclude]]\nfault.kind = [\"kick\", \"drop\"]\nsupply_V = { from = 23 }\n"
      "[[exclude]]\nfault.kind = [\"jam\", \"drop\"]\nfault.at_s = 1\n"
      "[[exclude]]\nfault.kind = \"drop\"\nfault.for_s = 0.5\nfault.probability = 1\n");
}

TEST(PairwiseSampling, RefusesWhatIsTooMuchToCover) {
  try {
    plan_of("pairwise",
            "fault.kind = \"jam\"\nfault.id = 1\nfault.at_s = { from = 0, to = 4, step = 0.001 }\n"
            "fault.jam.percent = { from = 1, to = 100, step = 0.01 }\n");
    FAIL() << "40 million pairs";
  } catch (const ConfigError& problem) {
    EXPECT_EQ(problem.key, "sampling");
    EXPECT_NE(problem.reason.find("10 million pairs"), std::string::npos);
  }
}

}  // namespace
}  // namespace lk::emulator
