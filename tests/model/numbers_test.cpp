// Compares the tick's own functions with the standard library.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "model/rounding.hpp"
#include "model/trig.hpp"

namespace lk::model {
namespace numbers_test {

constexpr double kSeries = 3e-10;  // accuracy of the polynomials

TEST(Trigonometry, AgreesWithTheLibrary) {
  std::mt19937_64 random(1);
  for (int decade = -3; decade <= 8; ++decade) {
    std::uniform_real_distribution<double> angle(-std::pow(10.0, decade), std::pow(10.0, decade));
    for (int n = 0; n < 20000; ++n) {
      const double theta = angle(random);
      const SinCos<double> own = sincos(theta);
      // Error of the polynomials plus rounding of the reduction, ulp(|θ|)/2 per step.
      const double tolerance = kSeries + std::abs(theta) * 3e-16;
      ASSERT_NEAR(own.sin, std::sin(theta), tolerance) << theta;
      ASSERT_NEAR(own.cos, std::cos(theta), tolerance) << theta;
      ASSERT_NEAR(sine(theta), std::sin(theta), tolerance) << theta;
    }
  }
}

TEST(Trigonometry, AgreesWithTheLibraryBetweenQuadrants) {
  for (int quarter = -40; quarter <= 40; ++quarter) {
    for (const double offset : {-1e-9, 0.0, 1e-9}) {
      const double theta = quarter * (kTwoPi / 4) + offset;
      EXPECT_NEAR(sincos(theta).sin, std::sin(theta), kSeries) << quarter;
      EXPECT_NEAR(sincos(theta).cos, std::cos(theta), kSeries) << quarter;
      EXPECT_NEAR(sine(theta), std::sin(theta), kSeries) << quarter;
    }
  }
  EXPECT_EQ(sincos(0.0).sin, 0.0);
  EXPECT_EQ(sincos(0.0).cos, 1.0);
  EXPECT_EQ(sine(0.0), 0.0);
}

TEST(Trigonometry, SmallAngleFormsAreWithinTheirError) {
  for (double x = -0.5; x <= 0.5; x += 1e-4) {
    // First omitted terms: x⁹/9! and x⁸/8!; plus 50 % for later ones.
    EXPECT_NEAR(sincos_small(x).sin, std::sin(x), 1e-15 + 1.5 * std::pow(std::abs(x), 9) / 362880);
    EXPECT_NEAR(sincos_small(x).cos, std::cos(x), 1e-15 + 1.5 * std::pow(x, 8) / 40320);
  }
  for (double x = -0.25; x <= 0.1; x += 1e-4) {
    EXPECT_NEAR(exp_small(x), std::exp(x), 4e-16 + 1.1 * std::pow(std::abs(x), 7) / 5040);
  }
}

TEST(RealNumbers, RoundAndFloorEqualTheLibrary) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> wide(-1e9, 1e9);
  std::uniform_real_distribution<double> narrow(-3.0, 3.0);
  for (int n = 0; n < 20000; ++n) {
    for (const double x : {wide(random), narrow(random), std::round(2.0 * narrow(random)) / 2.0}) {
      EXPECT_EQ(nearest(x), std::nearbyint(x)) << x;  // both: ties to even
      EXPECT_EQ(floored(x), std::floor(x)) << x;
    }
  }
}

TEST(RealNumbers, LanesAndScalarGiveEqualBits) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> angle(-1e4, 1e4);
  for (int n = 0; n < 2000; ++n) {
    alignas(64) std::array<double, Lanes::size()> x;
    for (double& value : x) {
      value = angle(random);
    }
    Lanes lanes;
    lanes.copy_from(x.data(), stdx::vector_aligned);
    const SinCos<Lanes> t = sincos(lanes);
    for (std::size_t lane = 0; lane < x.size(); ++lane) {
      EXPECT_EQ(t.sin[lane], sincos(x[lane]).sin);
      EXPECT_EQ(t.cos[lane], sincos(x[lane]).cos);
      EXPECT_EQ(sine(lanes)[lane], sine(x[lane]));
      EXPECT_EQ(floored(lanes)[lane], floored(x[lane]));
      EXPECT_EQ(exp_small<Lanes>(lanes * 1e-5)[lane], exp_small(x[lane] * 1e-5));
      EXPECT_EQ(clamp(lanes, Lanes(-10.0), Lanes(5.0))[lane], clamp(x[lane], -10.0, 5.0));
    }
  }
}

TEST(Trigonometry, DecayAgreesWithTheLibrary) {
  for (const double x : {0.0, -0.25, -0.3, -1.0, -7.0, -100.0}) {
    // With n halvings the remainder of the series counts 2^n times; 2e-8 at the edge.
    EXPECT_NEAR(exp_decay(x), std::exp(x), std::exp(x) * 2e-8 * std::max(1.0, -8.0 * x)) << x;
  }
  for (const double x : {-2000.0, -1e300, -HUGE_VAL}) EXPECT_EQ(exp_decay(x), 0.0) << x;
}

}  // namespace numbers_test
}  // namespace lk::model
