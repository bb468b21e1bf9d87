/// @file The texture of the log of three joints, over 50 specimens of its motor.

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "tests/fidelity/joint_figures.hpp"
#include "tests/fidelity/joint_log.hpp"
#include "tests/fidelity/record_range.hpp"
#include "tests/fidelity/statistics.hpp"

namespace lk::test {
namespace geared_drive_test {

constexpr std::uint64_t kSpecimens = 50;

struct Figures {
  std::vector<double> speed_dps, lag_1, iq_lsb, slope;

  void add(const std::vector<double>& speed, const std::vector<double>& iq) {
    speed_dps.push_back(deviation(speed));
    lag_1.push_back(autocorrelation(speed));
    iq_lsb.push_back(deviation(iq));
    slope.push_back(lk::test::slope(speed, iq));
  }
};

/// The logged value lies in the range of 9 of 10 specimens.
void expect_within(const std::vector<double>& specimens, const Band& log, const std::string& what) {
  record_range(what, specimens);
  EXPECT_LE(quantile(specimens, 0.05), log.high) << what;
  EXPECT_GE(quantile(specimens, 0.95), log.low) << what;
}
/// As expect_within, and the median of the specimens is within a fifth of the log.
void expect_like(const std::vector<double>& specimens, const Band& log, const std::string& what) {
  expect_within(specimens, log, what);
  const double middle = (log.low + log.high) / 2;
  EXPECT_NEAR(quantile(specimens, 0.5), middle, std::abs(0.2 * middle)) << what;
}

TEST(GearedDrive, CruisesLikeTheLog) {
  Figures figures;
  for (std::uint64_t seed = 1; seed <= kSpecimens; ++seed) {
    const JointLog log = move_joint(seed, kJitter_us, {}, emulator::Specimen::kDrawn);
    figures.add(cruise_speed(log), cruise_iq(log));
  }
  expect_like(figures.speed_dps, {21.7, 21.7}, "deviation of the speed, dps");
  expect_within(figures.lag_1, {-0.51, -0.51}, "lag-1 autocorrelation");
  expect_like(figures.iq_lsb, {8.0, 8.0}, "deviation of iq, LSB");
  expect_within(figures.slope, {-0.24, -0.17}, "iq over speed, LSB per dps");
}

/// Joint 1 speeds up from 162 to 334 dps, joint 3 slows down from 397 to 292 dps. The log's figures
/// are the least and the largest of its windows of 46 samples. Not met: the lag-1 autocorrelation,
/// −0.39 and −0.37 in the log, −0.2 to 0.1 here.
TEST(GearedDrive, FollowsATargetLikeTheLog) {
  struct Joint {
    double from_dps, to_dps;
    Band speed_dps, iq_lsb, slope;
  };
  for (const Joint& joint : {Joint{162, 334, {18.2, 22.1}, {6.4, 7.9}, {-0.20, -0.11}},
                             Joint{397, 292, {16.4, 18.8}, {6.4, 8.2}, {-0.21, -0.13}}}) {
    Figures figures;
    for (std::uint64_t seed = 1; seed <= kSpecimens; ++seed) {
      const JointLog log = track_joint(seed, joint.from_dps, joint.to_dps, 46);
      figures.add(log.pick(0, 46, &JointSample::speed_dps), log.pick(0, 46, &JointSample::iq_lsb));
    }
    SCOPED_TRACE(joint.from_dps);
    const std::string from = "from " + std::to_string(std::lround(joint.from_dps)) + " dps, ";
    record_range(from + "lag-1 autocorrelation", figures.lag_1);
    expect_like(figures.speed_dps, joint.speed_dps, from + "deviation of the speed, dps");
    expect_like(figures.iq_lsb, joint.iq_lsb, from + "deviation of iq, LSB");
    expect_within(figures.slope, joint.slope, from + "iq over speed, LSB per dps");
  }
}

}  // namespace geared_drive_test
}  // namespace lk::test
