/// @file Statistics of the log of three joints and of the emulated moves.

#include "tests/fidelity/joint_figures.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/fidelity/record_range.hpp"
#include "tests/fidelity/statistics.hpp"

namespace lk::test {
namespace joint_figures_test {

TEST(JointFigures, MatchTheLog) {
  for (const JointFigure& figure : joint_figures()) {
    const Band band = emulated_band(figure);
    record_range(figure.name, {band.low, band.high});
    EXPECT_LE(band.low - figure.apart, figure.real.high)
        << figure.name << ": " << band.low << " to " << band.high;
    EXPECT_GE(band.high + figure.apart, figure.real.low)
        << figure.name << ": " << band.low << " to " << band.high;
    // A wide band proves nothing: a width of half the figure detects larger errors.
    const double real = std::abs(figure.real.low + figure.real.high) / 2;
    EXPECT_LT(band.high - band.low, figure.widest * real)
        << figure.name << ": " << band.low << " to " << band.high;
  }
}

/// Over all moves, without a band: 75 to 95 % of the samples.
TEST(JointFigures, RestAsOftenAsTheLog) {
  std::size_t zero = 0;
  std::size_t all = 0;
  for (const JointLog& log : joint_moves()) {
    const auto rest = log.hold(&JointSample::speed_dps);
    zero += static_cast<std::size_t>(std::count(rest.begin(), rest.end(), 0.0));
    all += rest.size();
  }
  EXPECT_GE(static_cast<double>(zero), 0.75 * static_cast<double>(all));
  EXPECT_LE(static_cast<double>(zero), 0.95 * static_cast<double>(all));
}

/// With an arm fixed to the output (0.004 kg·m², assumed) and even sampling, the texture also
/// matches the log: several tones. The tone at 28 a turn alone would give −0.94.
TEST(FixedArm, HasTheTextureOfTheLog) {
  double correlation = 0;
  for (std::uint64_t seed = 1; seed <= kMoves; ++seed) {
    const JointLog log = move_joint(seed, 0, JointLoad{0.004, 0, 0, 0});
    correlation += autocorrelation(cruise_speed(log)) / kMoves;
  }
  EXPECT_GE(correlation, -0.6);
  EXPECT_LE(correlation, -0.4);
}

/// Spectrum over the rotor's angle. The log's speed has a peak at 28.0 a turn with 0.41 of the
/// variance; iq also has one at 14.0. The emulated speed has 0.62 to 0.69 there. The rest of the
/// real variance is unknown; 0.25 is the present error.
TEST(JointFigures, HaveTheSpectrumOfTheLog) {
  std::vector<double> shares;
  int peaks_at_28 = 0;  // single moves can have it elsewhere, by their sampling
  std::vector<double> iq_14;
  std::vector<double> iq_elsewhere;
  for (const JointLog& log : joint_moves()) {
    const auto turns = log.cruise(&JointSample::rotor_turns);
    if (std::abs(spectral_peak(turns, cruise_speed(log), 5, 40) - 28.0) < 0.15) ++peaks_at_28;
    shares.push_back(spectral_share(turns, cruise_speed(log), 28));
    iq_14.push_back(spectral_share(turns, cruise_iq(log), 14));
    for (const double order : {6.5, 9.3, 17.7, 20.9}) {
      iq_elsewhere.push_back(spectral_share(turns, cruise_iq(log), order));
    }
  }
  const Band band = bootstrap_band(shares, kJoints);
  record_range("share of 28 a turn", {band.low, band.high});
  EXPECT_GE(peaks_at_28, 9) << "of 12";
  EXPECT_GE(band.high, 0.41);
  EXPECT_LE(band.low, 0.41 + 0.25) << "the unexplained part has not grown";
  EXPECT_GT(mean(iq_14), 2 * mean(iq_elsewhere));
}

}  // namespace joint_figures_test
}  // namespace lk::test
