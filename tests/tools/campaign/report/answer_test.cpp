#include "tools/campaign/report/answer.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "report_support.hpp"

namespace lk::emulator {
namespace {

using std::chrono::milliseconds;
using testing::ElementsAre;

std::vector<CaseResult> one_of_each() {
  std::vector<CaseResult> results;
  for (std::size_t n = 0; n < kCaseOutcomes; ++n) {
    results.push_back(planted_case(n, "jam", static_cast<CaseOutcome>(n)));
  }
  return results;
}

TEST(Answer, CountsEveryOutcomeOfEveryKind) {
  std::vector<CaseResult> results = one_of_each();
  results.push_back(planted_case(9, "drop", CaseOutcome::kLate));
  const Answer answer = answer_of(planted_head(), stream_of(results));
  ASSERT_EQ(answer.kinds.size(), 3);  // in the order of the plan
  EXPECT_EQ(answer.kinds[0].kind, "jam");
  EXPECT_THAT(answer.kinds[0].outcomes, ElementsAre(1, 1, 1, 1, 1, 1, 1, 1, 1));
  EXPECT_THAT(answer.kinds[1].outcomes, ElementsAre(0, 0, 0, 0, 0, 1, 0, 0, 0));
  EXPECT_EQ(answer.kinds[2].cases(), 0);
  EXPECT_THAT(answer.all.outcomes, ElementsAre(1, 1, 1, 1, 1, 2, 1, 1, 1));
}

// By drive and by host: 2; late, silently wrong, hang, crash: 4. The three before say nothing.
TEST(Answer, CoverageIsOfWhatWasDangerous) {
  const Answer answer = answer_of(planted_head(), stream_of(one_of_each()));
  EXPECT_EQ(answer.all.coverage.covered, 2);
  EXPECT_EQ(answer.all.coverage.dangerous, 6);
  EXPECT_DOUBLE_EQ(*answer.all.coverage.share(), 1.0 / 3);
}

TEST(Answer, WhatDidNotFireIsNeverCovered) {
  const std::vector<CaseResult> results(20, planted_case(0, "jam", CaseOutcome::kNotFired));
  const Answer answer = answer_of(planted_head(), stream_of(results));
  EXPECT_FALSE(answer.all.coverage.share());
  EXPECT_EQ(answer.all.coverage.interval->lower, 0);
  EXPECT_EQ(answer.all.coverage.needs.at(0).all_hits, 36);
}

TEST(Answer, OnlyRandomCampaignsHaveIntervals) {
  for (const Sampling sampling :
       {Sampling::kFull, Sampling::kLatin, Sampling::kPairwise, Sampling::kAdaptive}) {
    const Answer answer = answer_of(planted_head(sampling), stream_of(one_of_each()));
    EXPECT_FALSE(answer.all.coverage.interval);
    EXPECT_FALSE(answer.kinds[0].coverage.interval);
    EXPECT_TRUE(answer.all.coverage.needs.empty());
  }
  const Answer answer = answer_of(planted_head(), stream_of(one_of_each()));
  EXPECT_TRUE(answer.kinds[0].coverage.interval);
}

TEST(Answer, LatenciesAreOfWhoeverNoticed) {
  CaseResult both = detected_case(2, "jam", CaseOutcome::kDetectedByHost, milliseconds(40));
  both.detected_by_drive = *both.first_effect_at + milliseconds(90);
  const Answer answer =
      answer_of(planted_head(),
                stream_of({detected_case(0, "jam", CaseOutcome::kDetectedByDrive, milliseconds(10)),
                           detected_case(1, "drop", CaseOutcome::kLate, milliseconds(300)), both,
                           planted_case(3, "jam", CaseOutcome::kSilentlyWrong)}));
  EXPECT_EQ(answer.all.by_drive.count(), 3);
  EXPECT_EQ(answer.all.by_host.worst(), milliseconds(40));
  EXPECT_EQ(answer.all.detected.count(), 3);
  EXPECT_EQ(answer.all.detected.quantile(0.5), milliseconds(40));
  EXPECT_EQ(answer.kinds[0].by_drive.worst(), milliseconds(90));
  EXPECT_EQ(answer.kinds[0].detected.worst(), milliseconds(40));
}

TEST(Answer, TheSpaceHasHoles) {
  CaseResult stopped = planted_case(1, "drop", CaseOutcome::kLate);
  stopped.state = "stopped";
  stopped.command = "9C";
  const Answer answer =
      answer_of(planted_head(), stream_of({planted_case(0, "jam", CaseOutcome::kNoEffect), stopped,
                                           planted_case(2, "jam", CaseOutcome::kNotFired)}));
  const Space& space = answer.space;
  EXPECT_THAT(space.kinds, ElementsAre("jam", "drop", "dip"));
  EXPECT_THAT(space.states, ElementsAre("off", "stopped", "running"));
  EXPECT_THAT(space.commands, ElementsAre("9C", "A4"));
  EXPECT_EQ(space.size(), 18);
  EXPECT_EQ(space.holes(), 16);
  EXPECT_EQ(space.at("jam", "running", "A4").cases, 1);  // not the one that met nothing
  EXPECT_EQ(space.at("drop", "stopped", "9C").failures, 1);
  EXPECT_EQ(space.at("dip", "off", "A4").cases, 0);
}

TEST(Answer, FailuresAreKeptByNumber) {
  const Answer answer =
      answer_of(planted_head(), stream_of({planted_case(7, "jam", CaseOutcome::kCrash),
                                           planted_case(3, "jam", CaseOutcome::kLate),
                                           planted_case(4, "jam", CaseOutcome::kTolerated)}));
  ASSERT_EQ(answer.residual.size(), 2);
  EXPECT_EQ(answer.residual[0].number, 3);
  EXPECT_EQ(answer.residual[1].number, 7);
  EXPECT_EQ(answer.residual_left_out, 0);
}

// Whatever there is too much of, the other outcomes keep their place.
TEST(Answer, MemoryIsBounded) {
  const CaseStream endless = [](const auto& take) {
    CaseResult late = planted_case(0, "jam", CaseOutcome::kLate);
    for (std::size_t n = 0; n < Answer::kMostOfOutcome + 10; ++n) take(late);
    take(planted_case(1, "jam", CaseOutcome::kCrash));
  };
  const Answer answer = answer_of(planted_head(), endless);
  EXPECT_EQ(answer.residual.size(), Answer::kMostOfOutcome + 1);
  EXPECT_EQ(answer.residual_left_out, 10);
  EXPECT_EQ(answer.residual.back().outcome, CaseOutcome::kCrash);
}

TEST(Answer, AnyCampaignIsOne) {
  CampaignHead head = planted_head();
  head.dimensions.clear();
  CaseResult plain = planted_case(0, "", CaseOutcome::kLate);
  plain.values.clear();
  plain.state.clear();
  const Answer answer = answer_of(head, stream_of({plain}));
  ASSERT_EQ(answer.kinds.size(), 1);
  EXPECT_EQ(answer.kinds[0].kind, "any");
  EXPECT_EQ(answer.space.at("any", "unknown", "A4").cases, 1);
  const Answer empty = answer_of(planted_head(), stream_of({}));
  EXPECT_EQ(empty.all.cases(), 0);
  EXPECT_EQ(empty.space.holes(), 0);  // of commands none is known
}

TEST(Answer, CommandsFitAShell) {
  const auto command = [](const std::string& plan_file) {
    return answer_of(planted_head(), stream_of({}), plan_file).command_of(4711);
  };
  EXPECT_EQ(command(""), "lk-emu campaign every_fault.toml --case 4711");
  EXPECT_EQ(command("plans/a.toml"), "lk-emu campaign plans/a.toml --case 4711");
  EXPECT_EQ(command("it's $(me).toml"), "lk-emu campaign 'it'\\''s $(me).toml' --case 4711");
}

TEST(Answer, CommandsCallThePlanAsItWasCalled) {
  CampaignHead head = planted_head();
  head.plan_called.word = "plans/a.toml";
  EXPECT_EQ(answer_of(head, stream_of({})).command_of(1), "lk-emu campaign plans/a.toml --case 1");
}

TEST(Answer, CommandsOfAdaptiveNameTheResultsThatHaveTheValues) {
  Answer answer = answer_of(planted_head(Sampling::kAdaptive), stream_of({}), "a.toml");
  answer.store_file = "a night.db";
  EXPECT_EQ(answer.command_of(1), "lk-emu campaign a.toml -o 'a night.db' --case 1");
}

}  // namespace
}  // namespace lk::emulator
