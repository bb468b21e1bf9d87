#include "tools/campaign/report/thresholds.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "emulator/ground/start_error.hpp"
#include "report_support.hpp"

namespace lk::emulator {
namespace {

using std::chrono::milliseconds;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using testing::ThrowsMessage;

/// 9 of 10 dangerous cases of `jam` detected in time, within 10 to 90 ms; the other late; a drop
/// not fired.
Answer nine_of_ten(Sampling sampling = Sampling::kRandom) {
  std::vector<CaseResult> results;
  for (std::uint64_t n = 1; n <= 9; ++n) {
    results.push_back(detected_case(n, "jam", CaseOutcome::kDetectedByDrive, milliseconds(10 * n)));
  }
  results.push_back(detected_case(10, "jam", CaseOutcome::kLate, milliseconds(400)));
  results.push_back(planted_case(11, "drop", CaseOutcome::kNotFired));
  return answer_of(planted_head(sampling), stream_of(results));
}

ThresholdResult check(const std::string& text, Sampling sampling = Sampling::kRandom) {
  return check_thresholds(nine_of_ten(sampling), {parse_threshold(text)}).at(0);
}

struct Row {
  const char* text;
  bool holds;
  double measured;
};

TEST(Thresholds, MeasureWhatTheySay) {
  for (const Row& row : std::vector<Row>{
           {"coverage>=0.9", true, 0.9},
           {"coverage>=0.91", false, 0.9},
           {"coverage<=0.9", true, 0.9},
           {"coverage[jam]>=0.9", true, 0.9},
           {"late<=0", false, 1},
           {" late <= 1 ", true, 1},
           {"late[drop]<=0", true, 0},
           {"silently_wrong<=0", true, 0},
           {"hang<=0", true, 0},
           {"crash<=0", true, 0},
           {"not_fired<=0", false, 1},
           {"detected_by_drive>=9", true, 9},
           {"latency.p50_s<=0.05", true, 0.05},
           {"latency.p99_s<=0.1", false, 0.4},
           {"latency.worst_s<=0.4", true, 0.4},
       }) {
    const ThresholdResult result = check(row.text);
    EXPECT_EQ(result.holds, row.holds) << row.text;
    ASSERT_TRUE(result.measured) << row.text;
    EXPECT_DOUBLE_EQ(*result.measured, row.measured) << row.text;
  }
}

// 9 of 10: 0.5550 in the tables.
TEST(Thresholds, ABoundIsThatOfTheInterval) {
  EXPECT_NEAR(*check("coverage.lower>=0.5").measured, 0.5550, 5e-5);
  EXPECT_TRUE(check("coverage.lower>=0.555").holds ==
              (*check("coverage.lower>=0").measured >= 0.555));
  EXPECT_FALSE(check("coverage.lower>=0.9").holds);
}

TEST(Thresholds, BoundsAreOfRandomCampaignsOnly) {
  EXPECT_THAT([] { check("coverage.lower>=0.5", Sampling::kLatin); },
              ThrowsMessage<StartError>(AllOf(HasSubstr("random"), HasSubstr("latin"))));
  EXPECT_TRUE(check("coverage>=0.9", Sampling::kLatin).holds);
}

TEST(Thresholds, WhatCannotBeMeasuredDoesNotHold) {
  for (const char* const text :
       {"coverage[drop]>=0", "coverage[dip]>=0", "latency.worst_s[drop]<=9"}) {
    const ThresholdResult result = check(text);
    EXPECT_FALSE(result.measured) << text;
    EXPECT_FALSE(result.holds) << text;
  }
  EXPECT_EQ(threshold_sentence(check("coverage[dip]>=0")), "coverage[dip]>=0: nothing to measure");
  EXPECT_EQ(threshold_sentence(check("coverage>=0.5")), "coverage>=0.5: measured 0.9");
}

TEST(Thresholds, MistakesAreToldInOneLine) {
  for (const char* const text : {"",
                                 "coverage",
                                 "coverage>0.9",
                                 "coverage=0.9",
                                 "coverage==0.9",
                                 "coverage>=",
                                 ">=1",
                                 "coverage>=x",
                                 "coverage>=0.9x",
                                 "coverage>=nan",
                                 "coverage>=inf",
                                 "coverage>=99",
                                 "coverage>=-0.1",
                                 "late<=1.5",
                                 "late<=-1",
                                 "latency.p99_s<=-1",
                                 "latency<=1",
                                 "lost<=1",
                                 "Coverage>=1",
                                 "coverage[]>=1",
                                 "coverage[jam>=1",
                                 "coverage]jam[>=1",
                                 "coverage[jam]x>=1",
                                 "coverage\n>=1",
                                 "coverage>=0.9>=1"}) {
    EXPECT_THAT([&] { parse_threshold(text); },
                ThrowsMessage<StartError>(AllOf(HasSubstr("--require"), Not(HasSubstr("\n")))))
        << text;
  }
  EXPECT_THAT(
      [] { parse_threshold("lost<=1"); },
      ThrowsMessage<StartError>(AllOf(HasSubstr("silently_wrong"), HasSubstr("latency.p99_s"))));
  EXPECT_THAT([] { check("coverage[jams]>=0.9"); },
              ThrowsMessage<StartError>(HasSubstr("jam, drop, dip")));
}

// What is not there may be what would have failed.
TEST(Thresholds, DoNotHoldWhereCasesAreMissing) {
  Answer answer = nine_of_ten();
  answer.missing = 3;
  const ThresholdResult result = check_thresholds(answer, {parse_threshold("coverage>=0.9")}).at(0);
  EXPECT_FALSE(result.holds);
  EXPECT_EQ(threshold_sentence(result), "coverage>=0.9: measured 0.9, but 3 cases are missing");
}

}  // namespace
}  // namespace lk::emulator
