#include "tools/campaign/report/statistics.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace lk::emulator {
namespace {

void expect_interval(std::uint64_t hits, std::uint64_t trials, double lower, double upper) {
  const Interval interval = clopper_pearson(hits, trials);
  EXPECT_NEAR(interval.lower, lower, 5e-5) << hits << " of " << trials;
  EXPECT_NEAR(interval.upper, upper, 5e-5) << hits << " of " << trials;
}

// Tables of exact 95 % limits of binomials have these four figures.
TEST(Statistics, IntervalsAreThoseOfTheTables) {
  expect_interval(10, 10, 0.6915, 1);
  expect_interval(0, 10, 0, 0.3085);
  expect_interval(99, 100, 0.9455, 0.9997);
  expect_interval(10, 20, 0.2720, 0.7280);
  expect_interval(1, 1, 0.0250, 1);
}

TEST(Statistics, NothingIsKnownOfWhatWasNotTried) { expect_interval(0, 0, 0, 1); }

// A bound of all hits has a closed form: 0.025 to the power of 1/n.
TEST(Statistics, MillionsOfCasesHaveAnInterval) {
  expect_interval(10'000'000, 10'000'000, std::pow(0.025, 1e-7), 1);
  EXPECT_NEAR(clopper_pearson(100'000'000, 100'000'000).lower, std::pow(0.025, 1e-8), 1e-12);
}

// n hits of n show p when p^n <= 0.025: ln 0.025 / ln 0.9 = 35.01, ln 0.025 / ln 0.99 = 367.04.
TEST(Statistics, ClaimsNeedThatManyHits) {
  EXPECT_EQ(claim_need(0, 0, 0.9).all_hits, 36);
  EXPECT_EQ(claim_need(0, 0, 0.99).all_hits, 368);
  EXPECT_EQ(claim_need(35, 35, 0.9).all_hits, 1);
  EXPECT_FALSE(claim_need(35, 35, 0.9).met);
  EXPECT_TRUE(claim_need(36, 36, 0.9).met);
  EXPECT_EQ(claim_need(36, 36, 0.9).all_hits, 0);
  EXPECT_EQ(claim_need(35, 35, 0.9).at_this_share, 1U);
}

// One miss of n: 0.9^n + n · 0.1 · 0.9^(n - 1) is 0.0259 at 53 and 0.0237 at 54.
TEST(Statistics, AMissTakesMoreHits) {
  EXPECT_EQ(claim_need(9, 10, 0.9).all_hits, 44);
  EXPECT_EQ(claim_need(52, 53, 0.9).all_hits, 1);
  EXPECT_TRUE(claim_need(53, 54, 0.9).met);
}

TEST(Statistics, AShareThatIsNotAboveTheClaimNeverReachesIt) {
  EXPECT_FALSE(claim_need(9, 10, 0.9).at_this_share);
  EXPECT_FALSE(claim_need(1, 2, 0.9).at_this_share);
  EXPECT_FALSE(claim_need(0, 0, 0.9).at_this_share);
  EXPECT_FALSE(claim_need(0, 5, 0.9).at_this_share);
}

TEST(Statistics, AShareAboveTheClaimReachesItInTime) {
  const ClaimNeed need = claim_need(19, 20, 0.9);
  ASSERT_TRUE(need.at_this_share);
  const std::uint64_t twenties = (20 + *need.at_this_share) / 20;
  EXPECT_LT(clopper_pearson(19 * (twenties - 1), 20 * (twenties - 1)).lower, 0.9);
  EXPECT_GE(clopper_pearson(19 * (twenties + 1), 20 * (twenties + 1)).lower, 0.9);
  EXPECT_GT(*need.at_this_share, need.all_hits);
}

}  // namespace
}  // namespace lk::emulator
