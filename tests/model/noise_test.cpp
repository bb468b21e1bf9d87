// The noise has the moments of a sum of four uniform numbers (Irwin–Hall), and no autocorrelation.
#include "model/noise.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <vector>

namespace lk::model {
namespace noise_test {

constexpr int kCount = 1'000'000;

std::vector<double> deviates(std::uint64_t seed) {
  std::uint64_t word = noise_seed(seed);
  std::vector<double> x(kCount);
  for (double& value : x) {
    value = normal_deviate(word);
  }
  return x;
}

TEST(Noise, HasTheMomentsOfFourUniforms) {
  for (const std::uint64_t seed : {0U, 1U, 2U, 12345U}) {
    double sum = 0;
    double sum_2 = 0;
    double sum_4 = 0;
    for (const double x : deviates(seed)) {
      ASSERT_LE(std::abs(x), 3.4642);  // 2·√3, the limits of the sum
      sum += x;
      sum_2 += x * x;
      sum_4 += x * x * x * x;
    }
    // Five standard errors of each estimate: √(1/n), √((κ − 1)/n), √(m8/n) with m8 = 35 at most.
    EXPECT_NEAR(sum / kCount, 0.0, 5.0 / std::sqrt(kCount));
    EXPECT_NEAR(sum_2 / kCount, 1.0, 5.0 * std::sqrt(1.7 / kCount));
    // Irwin–Hall, n = 4: excess kurtosis −6/(5·4) = −0.3.
    EXPECT_NEAR(sum_4 / kCount, 2.7, 5.0 * std::sqrt(35.0 / kCount));
  }
}

TEST(Noise, HasNoAutocorrelation) {
  const std::vector<double> x = deviates(7);
  for (const std::size_t lag : {1U, 2U, 3U, 4U, 6U, 8U, 12U, 100U}) {
    double sum = 0;
    double sum_of_squares = 0;
    for (std::size_t n = lag; n < x.size(); ++n) {
      sum += x[n] * x[n - lag];
      sum_of_squares += (x[n] * x[n] - 1.0) * (x[n - lag] * x[n - lag] - 1.0);
    }
    EXPECT_NEAR(sum / kCount, 0.0, 5.0 / std::sqrt(kCount)) << "lag " << lag;
    EXPECT_NEAR(sum_of_squares / kCount, 0.0, 5.0 * 1.7 / std::sqrt(kCount)) << "lag " << lag;
  }
}

TEST(Noise, HasTheDistributionOfFourUniforms) {
  // P(x < 1) of Irwin–Hall n = 4: u = 2 + 1/√3 of 0..4; F = 1 − (4 − u)⁴/24 + 4·(3 − u)⁴/24, u
  // in 2..3.
  const double u = 2.0 + 1.0 / std::sqrt(3.0);
  const double expected = 1.0 - std::pow(4.0 - u, 4) / 24.0 + 4.0 * std::pow(3.0 - u, 4) / 24.0;
  int below = 0;
  for (const double x : deviates(3)) {
    below += x < 1.0 ? 1 : 0;
  }
  EXPECT_NEAR(static_cast<double>(below) / kCount, expected,
              5.0 * std::sqrt(expected * (1 - expected) / kCount));
}

TEST(Noise, SeedsGiveIndependentNoise) {
  std::set<std::uint64_t> words;
  for (std::uint64_t seed = 0; seed < 10000; ++seed) {
    words.insert(noise_seed(seed));
  }
  EXPECT_EQ(words.size(), 10000U);
  EXPECT_FALSE(words.contains(0));  // xorshift never leaves state 0

  const std::vector<double> a = deviates(1);
  const std::vector<double> b = deviates(2);
  double sum = 0;
  for (std::size_t n = 0; n < a.size(); ++n) {
    sum += a[n] * b[n];
  }
  EXPECT_NEAR(sum / kCount, 0.0, 5.0 / std::sqrt(kCount));
}

/// xorshift of 0 stays 0. Only this seed would give that state.
TEST(Noise, NoSeedGivesConstantNoise) {
  std::uint64_t word = noise_seed(0 - 0x9E3779B97F4A7C15U);
  const double first = normal_deviate(word);
  EXPECT_NE(normal_deviate(word), first);
}

}  // namespace noise_test
}  // namespace lk::model
