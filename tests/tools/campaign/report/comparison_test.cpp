#include "tools/campaign/report/comparison.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "emulator/ground/start_error.hpp"
#include "report_support.hpp"
#include "tools/campaign/report/answer_text.hpp"

namespace lk::emulator {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using testing::ThrowsMessage;

Comparison compared(const std::vector<CaseOutcome>& before, const std::vector<CaseOutcome>& now) {
  const auto source = [](const std::vector<CaseOutcome>& outcomes) {
    std::vector<CaseResult> results;
    for (const CaseOutcome outcome : outcomes) {
      results.push_back(planted_case(results.size(), "jam", outcome));
    }
    return source_of(results);
  };
  return compare_campaigns(planted_head(), source(before), planted_head(), source(now));
}

TEST(Comparison, CountsWhatMoved) {
  using enum CaseOutcome;
  const Comparison comparison =
      compared({kNoEffect, kDetectedByHost, kLate, kCrash, kTolerated, kDetectedByDrive},
               {kNoEffect, kSilentlyWrong, kDetectedByHost, kHang, kTolerated, kDetectedByHost});
  EXPECT_EQ(comparison.same, 2);
  EXPECT_EQ(comparison.worse, 2);
  EXPECT_EQ(comparison.better, 2);
  EXPECT_TRUE(comparison.is_worse());
  ASSERT_EQ(comparison.cases.size(), 2);
  EXPECT_EQ(comparison.cases[0].now.number, 1);
  EXPECT_EQ(comparison.cases[0].before, kDetectedByHost);
  EXPECT_EQ(comparison.cases[0].now.outcome, kSilentlyWrong);
  EXPECT_EQ(comparison.moves[4][6], 1);  // detected by the host -> silently wrong
  EXPECT_EQ(comparison.moves[1][1], 1);
}

TEST(Comparison, WhatDidNotFireIsNeitherWorseNorBetter) {
  using enum CaseOutcome;
  const Comparison comparison =
      compared({kNotFired, kCrash, kNotFired}, {kCrash, kNotFired, kNotFired});
  EXPECT_EQ(comparison.not_fired, 2);
  EXPECT_EQ(comparison.same, 1);
  EXPECT_EQ(comparison.worse + comparison.better, 0);
  EXPECT_FALSE(comparison.is_worse());
}

TEST(Comparison, CasesOfOneSideAreCounted) {
  const auto late = [](std::uint64_t number) {
    return planted_case(number, "jam", CaseOutcome::kLate);
  };
  const Comparison comparison =
      compare_campaigns(planted_head(), source_of({late(2), late(3), late(9)}), planted_head(),
                        source_of({late(3), late(999)}));
  EXPECT_EQ(comparison.only_before, 2);
  EXPECT_EQ(comparison.only_now, 1);
  EXPECT_EQ(comparison.same, 1);
}

TEST(Comparison, AnotherPlanIsRefused) {
  const auto refuses = [](const std::function<void(CampaignHead&)>& change, const char* why) {
    CampaignHead now = planted_head();
    change(now);
    EXPECT_THAT([&] { compare_campaigns(planted_head(), source_of({}), now, source_of({})); },
                ThrowsMessage<StartError>(
                    AllOf(HasSubstr(why), HasSubstr("compare: "), Not(HasSubstr("\n")))))
        << why;
  };
  refuses([](auto& head) { head.seed = 2; }, "seed was 1 and is 2");
  refuses([](auto& head) { head.numbers = 7; }, "1000 numbers and has 7");
  refuses([](auto& head) { head.sampling = Sampling::kFull; }, "sampling was random and is full");
  refuses([](auto& head) { head.dimensions[1].to = 1; }, "fault.for_s has other values");
  refuses([](auto& head) { head.dimensions.pop_back(); }, "fault.for_s is gone");
  refuses([](auto& head) { head.dimensions.push_back({.name = "supply\n_V", .words = {}}); },
          "was not there");
}

// Of dimensions there are words and ends only: a list between them or weights may have changed.
TEST(Comparison, OtherCasesOfTheSameNumbersAreRefused) {
  const CaseResult before = planted_case(7, "jam", CaseOutcome::kLate);
  CaseResult now = before;
  const auto compare = [&] {
    compare_campaigns(planted_head(), source_of({before}), planted_head(), source_of({now}));
  };
  EXPECT_NO_THROW(compare());
  now.values[1] = 0.25;
  EXPECT_THAT(compare,
              ThrowsMessage<StartError>(HasSubstr("case 7 had fault.for_s = 0.1 and has 0.25")));
  now.values[1].reset();
  EXPECT_THAT(compare, ThrowsMessage<StartError>(HasSubstr("and has nothing")));
}

TEST(Comparison, AnotherVersionIsNotAnotherPlan) {
  CampaignHead now = planted_head();
  now.version = "1.1.0";
  now.input_hash = "ffff";
  now.tolerant_time.reset();
  const Comparison comparison =
      compare_campaigns(planted_head(), source_of({}), now, source_of({}));
  EXPECT_THAT(comparison_text(comparison, "a.toml"), HasSubstr("has changed in between"));
}

TEST(Comparison, AdaptiveCampaignsAreRefused) {
  const CampaignHead head = planted_head(Sampling::kAdaptive);
  EXPECT_THAT([&] { compare_campaigns(head, source_of({}), head, source_of({})); },
              ThrowsMessage<StartError>(HasSubstr("adaptive")));
}

// A file that somebody wrote must not make the program take all memory.
TEST(Comparison, NumbersBeyondThePlanAreRefused) {
  const CaseSource far = source_of({planted_case(1ULL << 60U, "jam", CaseOutcome::kLate)});
  EXPECT_THAT([&] { compare_campaigns(planted_head(), far, planted_head(), source_of({})); },
              ThrowsMessage<StartError>(HasSubstr("is not one of the 1000")));
}

TEST(Comparison, TellsThePerson) {
  using enum CaseOutcome;
  const std::string text =
      comparison_text(compared({kDetectedByHost, kLate}, {kSilentlyWrong, kLate}), "a.toml");
  EXPECT_THAT(text, HasSubstr("1 case worse, 0 better, 1 with the same outcome"));
  EXPECT_THAT(text, HasSubstr("detected by the host -> silently wrong: 1"));
  EXPECT_THAT(text, HasSubstr("worse: case 0: jam, silently wrong"));
  EXPECT_THAT(text, HasSubstr("lk-emu campaign a.toml --case 0"));
}

}  // namespace
}  // namespace lk::emulator
