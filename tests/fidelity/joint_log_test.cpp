/// @file Compares each joint move with the log over time; joint_figures_test.cpp covers statistics
/// over all moves. The bounds are the spread of such drives.

#include "tests/fidelity/joint_log.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/fidelity/record_range.hpp"
#include "tests/fidelity/statistics.hpp"

namespace lk::test {
namespace joint_log_test {

class Joint : public ::testing::TestWithParam<std::uint64_t> {
 protected:
  const JointLog log_ = move_joint(GetParam());
};

/// The log overshoots to −698 dps, 22 %, and settles within 150 ms.
TEST_P(Joint, OvershootsLikeTheLog) {
  double most = 0;
  for (std::size_t n = 0; n < 13; ++n) most = std::max(most, -log_.samples[n].speed_dps);
  record_range("overshoot", {most / kLimit_dps - 1});
  EXPECT_GE(most, 1.10 * kLimit_dps);
  EXPECT_LE(most, 1.30 * kLimit_dps);
}

/// The log: mean −574 dps, standard deviation 22 dps; iq mean −14 LSB, mostly friction, deviation
/// 8; slope −0.17 to −0.24 LSB per dps. A move of 70 samples adds three times its fit error: 5 LSB
/// of noise over 22 dps and √70, 0.03.
TEST_P(Joint, CruisesLikeTheLog) {
  const std::vector<double> speed_dps = log_.cruise(&JointSample::speed_dps);
  const std::vector<double> iq_lsb = log_.cruise(&JointSample::iq_lsb);
  EXPECT_NEAR(mean(speed_dps), -kLimit_dps, 0.01 * kLimit_dps);
  EXPECT_NEAR(deviation(speed_dps), 21.7, 0.2 * 21.7);
  EXPECT_NEAR(mean(iq_lsb), -14, 0.2 * 14);
  EXPECT_NEAR(deviation(iq_lsb), 8.0, 0.35 * 8.0);
  EXPECT_GE(slope(speed_dps, iq_lsb), -0.24 - 0.09);
  EXPECT_LE(slope(speed_dps, iq_lsb), -0.17 + 0.09);
}

/// The log: full speed 3.9° before the target, then ±4 counts of ringing for 170 ms, iq ±20 LSB.
/// Tolerance: a third more, and a count.
TEST_P(Joint, StopsLikeTheLog) {
  const std::size_t stop = log_.stop_begins;
  ASSERT_LT(stop + 40, log_.samples.size());
  int before_target = 0;
  int past_target = 0;
  for (std::size_t n = stop + 1; n < stop + 14; ++n) {
    const int error = log_.samples[n].error_counts;
    EXPECT_LE(std::abs(error), 6) << n - stop;
    EXPECT_LE(std::abs(log_.samples[n].iq_lsb), 27 + 12) << n - stop << ", with friction";
    before_target = std::max(before_target, error);
    past_target = std::min(past_target, error);
  }
  EXPECT_GE(before_target, 3);
  EXPECT_LE(past_target, -3);
  for (std::size_t n = stop + 30; n < stop + 40; ++n) {
    EXPECT_LE(std::abs(log_.samples[n].error_counts), 1) << "done";
  }
}

/// The log: error ≤ 1 count; iq noise sd 3.5 to 6 LSB. Speed is 0 in 82 to 85 % of the samples (by
/// the position within a count), otherwise a few steps of about 5 dps; see JointFigures.
TEST_P(Joint, HoldsLikeTheLog) {
  for (std::size_t n = kTravelSamples; n < log_.samples.size(); ++n) {
    EXPECT_LE(std::abs(log_.samples[n].error_counts), 1) << "sample " << n;
  }
  const double iq_noise_lsb = noise(log_.hold(&JointSample::iq_lsb));
  EXPECT_GE(iq_noise_lsb, 3.5);
  EXPECT_LE(iq_noise_lsb, 6);
  const auto speed_dps = log_.hold(&JointSample::speed_dps);
  for (const double dps : speed_dps) {
    const double steps = dps / kJointSpeedStep_dps;
    EXPECT_LE(std::abs(steps - std::round(steps)), 0.5 / 5.4) << dps << " dps, shown in whole ones";
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, Joint, ::testing::Range<std::uint64_t>(1, kMoves + 1));

/// Returns the time from 64 to 561 dps, ms.
double start_ms(const JointLog& log) {
  const auto reached_ms = [&log](double dps) {
    double before = 0;
    for (std::size_t n = 0; n < 40; ++n) {
      const double now = -log.samples[n].speed_dps;
      if (now >= dps) return 12.0 * (static_cast<double>(n) + (dps - before) / (now - before));
      before = now;
    }
    return 1e9;
  };
  return reached_ms(561) - reached_ms(64);
}

/// The log has −64, −450 and −561 dps in three samples, over 24 ms; tolerance is one sample of 12
/// ms. The emulated joint reaches 500 dps after one sample and then waits for its load.
TEST(JointStart, IsAsFastAsTheLog) {
  std::vector<double> times_ms;
  for (std::uint64_t seed = 1; seed <= kMoves; ++seed)
    times_ms.push_back(start_ms(move_joint(seed)));
  record_range("64 to 561 dps, ms", times_ms);
  EXPECT_NEAR(quantile(times_ms, 0.5), 24, 12.5);
}

/// The log's iq at the start: −54, −36, −18, 2, 13, 5, 7, −20, −39, −20, −9 LSB, 12 ms apart. It
/// oscillates at about 12 Hz, by 67 and 52 LSB. The mean of the moves, whose ripples differ,
/// oscillates by 36 and 29. The test requires half; the rest is not explained.
TEST(JointStart, RingsLikeTheLog) {
  std::vector<double> iq_lsb(13, 0.0);
  for (std::uint64_t seed = 1; seed <= kMoves; ++seed) {
    const JointLog log = move_joint(seed);
    for (std::size_t n = 0; n < iq_lsb.size(); ++n) iq_lsb[n] += log.samples[n].iq_lsb / kMoves;
  }
  const auto top = std::max_element(iq_lsb.begin() + 2, iq_lsb.begin() + 7);
  const double first = *std::min_element(iq_lsb.begin(), top);
  const auto second = std::min_element(top, iq_lsb.end());
  record_range("iq swing, LSB", {*top - first, *top - *second});
  EXPECT_GT(*top - first, 67 / 2.0);
  EXPECT_GT(*top - *second, 52 / 2.0);
  // From a maximum to the next minimum is half a period: 4 samples in the log.
  EXPECT_NEAR(static_cast<double>(second - top), 4, 1.5);
}

/// The log has −18 dps one sample after full speed, the rest in the load's spring: within the range
/// of moves with its jitter.
TEST(JointStop, HasTheSpeedOfTheLogAfterOneSample) {
  std::vector<double> speed_dps;
  for (const JointLog& log : joint_moves()) {
    speed_dps.push_back(-log.samples[log.stop_begins].speed_dps);
  }
  record_range("speed after one sample, dps", speed_dps);
  EXPECT_LE(quantile(speed_dps, 0), 18);
  EXPECT_GE(quantile(speed_dps, 1), 18);
}

/// A loaded joint of the log oscillates at 12.0 Hz after a stop. Crossings of the target are half a
/// period apart; one sample of 12 ms in a period of 83 ms is 1.5 Hz.
TEST(JointStop, RingsLikeTheLog) {
  double sum_Hz = 0;
  for (std::uint64_t seed = 1; seed <= kMoves; ++seed) {
    const JointLog log = move_joint(seed);
    std::vector<double> crossings_s;
    for (std::size_t n = log.stop_begins; crossings_s.size() < 3 && n + 1 < log.samples.size();
         ++n) {
      const double now = log.samples[n].error_counts;
      const double next = log.samples[n + 1].error_counts;
      if (now * next <= 0 && now != next && now != 0) {
        crossings_s.push_back(0.012 * (static_cast<double>(n) + now / (now - next)));
      }
    }
    ASSERT_EQ(crossings_s.size(), 3U) << "seed " << seed;
    sum_Hz += 1 / (crossings_s[2] - crossings_s[0]);
  }
  record_range("ringing, Hz", {sum_Hz / kMoves});
  EXPECT_NEAR(sum_Hz / kMoves, 12.0, 1.5);
}

}  // namespace joint_log_test
}  // namespace lk::test
