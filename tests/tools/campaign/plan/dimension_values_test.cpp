#include "tools/campaign/plan/dimension_values.hpp"

#include <gtest/gtest.h>

namespace lk::emulator {
namespace {

double number(const CaseValue& value) { return std::get<double>(value); }

TEST(DimensionValues, OfAListGivesEachItsTurn) {
  const DimensionValues set = DimensionValues::listed({1.0, 2.0, 4.0, 8.0});
  EXPECT_EQ(number(set.quantile(0)), 1);
  EXPECT_EQ(number(set.quantile(0.249)), 1);
  EXPECT_EQ(number(set.quantile(0.25)), 2);
  EXPECT_EQ(number(set.quantile(0.9999999999)), 8);
}

TEST(DimensionValues, OfWeightsGivesEachItsShare) {
  const DimensionValues set =
      DimensionValues::listed({std::string("a"), std::string("b"), std::string("c")}, {3, 0, 1});
  EXPECT_EQ(value_text(set.quantile(0.74)), "a");
  EXPECT_EQ(value_text(set.quantile(0.76)), "c");
}

TEST(DimensionValues, OfARangeIsEvenOrEvenInTheLogarithm) {
  EXPECT_DOUBLE_EQ(
      number(DimensionValues::ranged({.from = 2, .to = 10, .mean = {}}).quantile(0.25)), 4);
  EXPECT_DOUBLE_EQ(
      number(
          DimensionValues::ranged({.from = 1, .to = 100, .log = true, .mean = {}}).quantile(0.5)),
      10);
}

// Φ⁻¹(0.8413) = 1: a standard deviation above the mean lies at 84.13 %, cut off far away.
TEST(DimensionValues, OfANormalDistributionHasItsDeviation) {
  const DimensionValues set = DimensionValues::ranged({.from = 0, .to = 100, .mean = 50, .sd = 5});
  EXPECT_NEAR(number(set.quantile(0.5)), 50, 0.01);
  EXPECT_NEAR(number(set.quantile(0.841345)), 55, 0.01);
  EXPECT_EQ(number(set.quantile(0)), 0);
}

TEST(DimensionValues, CutOffInItsTailStaysWithinItsEnds) {
  const DimensionValues set = DimensionValues::ranged({.from = 90, .to = 100, .mean = 0, .sd = 1});
  for (const double u : {0.0, 0.3, 0.999}) {
    EXPECT_GE(number(set.quantile(u)), 90);
    EXPECT_LE(number(set.quantile(u)), 100);
  }
}

TEST(DimensionValues, IsRoundedAsAPersonWouldTypeIt) {
  EXPECT_EQ(value_text(DimensionValues::ranged({.from = 0, .to = 1, .mean = {}}).quantile(1.0 / 3)),
            "0.3333");
  EXPECT_EQ(value_text(DimensionValues::ranged(
                           {.from = 0, .to = 10, .mean = {}, .rounding = Rounding::kMilliseconds})
                           .quantile(1.0 / 3)),
            "3.333");
  EXPECT_EQ(value_text(DimensionValues::ranged(
                           {.from = 0, .to = 1000, .mean = {}, .rounding = Rounding::kWhole})
                           .quantile(1.0 / 3)),
            "333");
}

TEST(DimensionValues, KnowsWhereAValueLies) {
  const DimensionValues even = DimensionValues::ranged({.from = 2, .to = 10, .mean = {}});
  const DimensionValues log =
      DimensionValues::ranged({.from = 1, .to = 100, .log = true, .mean = {}});
  const DimensionValues list = DimensionValues::listed({std::string("a"), std::string("b")});
  EXPECT_DOUBLE_EQ(even.place_of(4.0), 0.25);
  EXPECT_DOUBLE_EQ(log.place_of(10.0), 0.5);
  EXPECT_EQ(list.quantile(list.place_of(std::string("b"))), CaseValue(std::string("b")));
}

}  // namespace
}  // namespace lk::emulator
