#include "tools/campaign/report/latency_counts.hpp"

#include <gtest/gtest.h>

namespace lk::emulator {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

LatencyCounts counts_up_to(int most) {
  LatencyCounts counts;
  for (int ms = most; ms >= 1; --ms) counts.add(milliseconds(ms));
  return counts;
}

// Of 1 to n ms the nearest rank of a share is ceil(share · n) ms.
TEST(LatencyCounts, QuantilesAreNearestRanks) {
  const LatencyCounts ten = counts_up_to(10);
  EXPECT_EQ(ten.quantile(0.5), milliseconds(5));
  EXPECT_EQ(ten.quantile(0.99), milliseconds(10));
  EXPECT_EQ(ten.worst(), milliseconds(10));
  const LatencyCounts many = counts_up_to(201);
  EXPECT_EQ(many.quantile(0.5), milliseconds(101));
  EXPECT_EQ(many.quantile(0.99), milliseconds(199));
  EXPECT_EQ(many.quantile(1), milliseconds(201));
  EXPECT_FALSE(many.rounded());
}

TEST(LatencyCounts, OneIsAllOfThem) {
  const LatencyCounts one = counts_up_to(1);
  EXPECT_EQ(one.quantile(0.5), milliseconds(1));
  EXPECT_EQ(one.quantile(0.99), milliseconds(1));
}

TEST(LatencyCounts, NoneHasNoQuantile) {
  const LatencyCounts none;
  EXPECT_FALSE(none.quantile(0.5));
  EXPECT_FALSE(none.worst());
  EXPECT_TRUE(none.bins().empty());
}

TEST(LatencyCounts, MoreThanAreKeptAreRoundedUp) {
  constexpr int kMany = 30'000;
  LatencyCounts counts;
  for (int n = 1; n <= kMany; ++n) counts.add(nanoseconds(1'000'003L * n));
  EXPECT_TRUE(counts.rounded());
  EXPECT_EQ(counts.worst(), nanoseconds(1'000'003L * kMany));
  const double truth_ns = 1'000'003.0 * kMany / 2;
  const auto p50_ns = static_cast<double>(counts.quantile(0.5)->count());
  EXPECT_GE(p50_ns, truth_ns);
  // 10 000 values in the octaves below the largest are told apart to one in two thousand and more.
  EXPECT_LE(p50_ns, truth_ns * (1 + 1.0 / 2048));
}

TEST(LatencyCounts, BinsHoldAll) {
  LatencyCounts counts = counts_up_to(100);
  counts.add(nanoseconds(-5));  // before the first effect was seen
  std::uint64_t sum = 0;
  for (const auto& bin : counts.bins()) sum += bin.count;
  EXPECT_EQ(sum, 101);
  EXPECT_DOUBLE_EQ(counts.bins().front().up_to_s, 1e-6);
  EXPECT_NEAR(counts.bins().back().up_to_s, 0.1, 1e-12);
}

}  // namespace
}  // namespace lk::emulator
