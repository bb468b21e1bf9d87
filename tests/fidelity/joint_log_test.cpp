/// @file Each of the joint's moves as the log's, in time; figures over all moves are in
/// joint_figures_test.cpp. The bounds here are the spread that such a drive may show.

#include "tests/fidelity/joint_log.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/fidelity/statistics.hpp"

namespace lk::test {
namespace joint_log_test {

class Joint : public ::testing::TestWithParam<std::uint64_t> {
 protected:
  const JointLog log_ = move_joint(GetParam());
};

/// The log has −64, −450 and −561 dps in three samples, 24 ms from the first to the last; a sample
/// of 12 ms more or less.
TEST_P(Joint, StartsLikeTheLog) {
  double before = 0;
  for (std::size_t n = 0; n < 40; ++n) {
    const double now = -log_.samples[n].speed_dps;
    if (now >= 561) {
      const double time_ms = 12.0 * (static_cast<double>(n) + (561 - before) / (now - before));
      EXPECT_GE(time_ms, 12);
      EXPECT_LE(time_ms, 36);
      return;
    }
    before = now;
  }
  FAIL() << "never reached 561 dps";
}

/// The log overshoots to −698 dps, 22 %, and has settled by 150 ms. With the arm of these tests it
/// is less; more than twice the ripple of 22 dps it has to be.
TEST_P(Joint, OvershootsLikeTheLog) {
  double most = 0;
  for (std::size_t n = 0; n < 13; ++n) most = std::max(most, -log_.samples[n].speed_dps);
  EXPECT_GE(most, kLimit_dps + 2 * 22);
  EXPECT_LE(most, 1.30 * kLimit_dps);
}

/// The log: mean −574 dps, standard deviation 22 dps; iq mean −14 LSB, mostly friction, deviation
/// 8; and −0.17 to −0.24 LSB per dps between the two, to which a move of 70 samples adds the error
/// of its fit: 5 LSB of noise over 22 dps and √70, 0.03, thrice.
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

/// The log: full speed 3.9° before the target, −18 dps one sample later. Its overshoot is 4 counts;
/// with the arm of these tests it is a third of a degree of the rotor more, which is not explained.
TEST_P(Joint, StopsLikeTheLog) {
  ASSERT_LT(log_.stop_begins + 2, log_.samples.size());
  EXPECT_LT(std::abs(log_.samples[log_.stop_begins].speed_dps), 0.35 * kLimit_dps)
      << "within one sample";
  EXPECT_LT(std::abs(log_.samples[log_.stop_begins + 2].speed_dps), 0.05 * kLimit_dps);
  for (std::size_t n = log_.stop_begins; n < log_.samples.size(); ++n) {
    EXPECT_GE(log_.samples[n].error_counts, -4 - 8);
  }
}

/// The log: error ≤ 1 count; iq noise sd 3.5 to 6 LSB; speed 0 in 82 to 85 % of the samples, which
/// depends on where in a count the shaft stands, and otherwise a few steps of about 5 dps.
TEST_P(Joint, HoldsLikeTheLog) {
  for (std::size_t n = kTravelSamples; n < log_.samples.size(); ++n) {
    EXPECT_LE(std::abs(log_.samples[n].error_counts), 1) << "sample " << n;
  }
  const double iq_noise_lsb = noise(log_.hold(&JointSample::iq_lsb));
  EXPECT_GE(iq_noise_lsb, 3.5);
  EXPECT_LE(iq_noise_lsb, 6);
  const auto speed_dps = log_.hold(&JointSample::speed_dps);
  EXPECT_LE(deviation(speed_dps), 3.6);
  for (const double dps : speed_dps) {
    const double steps = dps / kJointSpeedStep_dps;
    EXPECT_LE(std::abs(steps - std::round(steps)), 0.5 / 5.4) << dps << " dps, shown in whole ones";
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, Joint, ::testing::Range<std::uint64_t>(1, kMoves + 1));

/// A loaded joint of the log swings at 12.0 Hz after a stop, dying away with 0.30 s. What hung
/// there is not known: 0.02 kg·m² (assumed). Half-periods in whole samples of 12 ms: 1 Hz.
TEST(LoadedJoint, Rings) {
  const JointLog log = move_joint(1, {.arm_kg_m2 = 0.02});
  std::vector<std::size_t> extremes;
  const auto& s = log.samples;
  for (std::size_t n = log.stop_begins; n + 1 < s.size() && extremes.size() < 4; ++n) {
    const int here = s[n].error_counts;
    if ((here - s[n - 1].error_counts) * (s[n + 1].error_counts - here) < 0) extremes.push_back(n);
  }
  ASSERT_GE(extremes.size(), 3U);
  const double period_s = 0.012 * static_cast<double>(extremes[2] - extremes[0]);
  EXPECT_NEAR(1 / period_s, 12.0, 2.0);
  EXPECT_GT(std::abs(s[extremes[2]].error_counts), 0.3 * std::abs(s[extremes[0]].error_counts));
}

}  // namespace joint_log_test
}  // namespace lk::test
