/// @file The behaviour of real drives. First that of a geared MG drive with 14 pole pairs, seen
/// through the same frames: its owner's log has 0xA4 with a limit of 573 dps, gains 100/100, 40/14,
/// 50/50, 24 V, no ramps, sampled every 12 ms over CAN. docs/decisions/0003 tells of it; the bounds
/// here are the spread that such a drive may show.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <numeric>

#include "tests/support/profile.hpp"
#include "tests/support/test_bus.hpp"

namespace lk::test {
namespace real_drive_test {

using std::chrono::milliseconds;

constexpr double kLimit_dps = 573;
constexpr milliseconds kSampling{12};
constexpr std::size_t kTravelSamples = 140;  // 1.7 s: the move takes 1.1 s, then it settles
constexpr std::size_t kHoldSamples = 300;
/// At the output, assumed: the finger that hung on the log's shaft, so that the start fits.
constexpr double kArm_kg_m2 = 0.004;
constexpr double kIqLsb_A = 33.0 / 2048.0;  // of the legacy reply; the log's is the same to 0.01 %

struct Sample {
  double speed_dps = 0;
  double iq_lsb = 0;
  int error_counts = 0;  // of 65536 per output turn, from the target
};

struct Log {
  std::vector<Sample> samples;
  std::size_t stop_begins = 0;  // first sample of the deceleration
};

double mean(const std::vector<double>& x) {
  return std::accumulate(x.begin(), x.end(), 0.0) / static_cast<double>(x.size());
}
double deviation(const std::vector<double>& x) {
  const double m = mean(x);
  double sum = 0;
  for (const double v : x) sum += (v - m) * (v - m);
  return std::sqrt(sum / static_cast<double>(x.size()));
}

/// The standard deviation from one sample to the next: an integrator that wanders within the
/// friction is not in it.
double noise(const std::vector<double>& x) {
  double sum = 0;
  for (std::size_t n = 1; n < x.size(); ++n) sum += (x[n] - x[n - 1]) * (x[n] - x[n - 1]) / 2;
  return std::sqrt(sum / static_cast<double>(x.size() - 1));
}
/// The lag-1 autocorrelation.
double autocorrelation(const std::vector<double>& x) {
  const double m = mean(x);
  double sum = 0;
  for (std::size_t n = 1; n < x.size(); ++n) sum += (x[n] - m) * (x[n - 1] - m);
  return sum / (static_cast<double>(x.size()) * deviation(x) * deviation(x));
}
/// dy/dx of the straight line through the samples.
double slope(const std::vector<double>& x, const std::vector<double>& y) {
  double sum = 0;
  for (std::size_t n = 0; n < x.size(); ++n) sum += (x[n] - mean(x)) * (y[n] - mean(y));
  return sum / (static_cast<double>(x.size()) * deviation(x) * deviation(x));
}

/// The log's move of −600° from a boot angle, sampled like the log.
Log move_and_log(std::uint64_t seed, double arm_kg_m2 = kArm_kg_m2) {
  emulator::ServoConfig servo;
  servo.id = 1;
  servo.profile = profile("mg4005-14p");
  servo.profile.drive.load.J = arm_kg_m2;
  servo.rom = servo.profile.factory;
  servo.rom.gains = {100, 100, 40, 14, 50, 50};
  servo.boot_angle_deg = 10.0 + 13.0 * static_cast<double>(seed);
  emulator::BusConfig config = bus_config({});
  config.seed = seed;
  config.servos.push_back(servo);
  Host host(config);
  host.wait(milliseconds(200));

  const auto target_cdeg = host.multi_turn_cdeg() - 60000;
  host.get<protocol::State2>(
      protocol::Position2{.max_speed_dps = static_cast<std::uint16_t>(kLimit_dps),
                          .target_cdeg = static_cast<std::int32_t>(target_cdeg)});
  // 65536 counts span one output turn, ten rotor turns (360000 hundredths of a degree).
  const auto target_counts =
      static_cast<int>(std::lround(static_cast<double>(target_cdeg) * 65536 / 360000));
  Log log;
  for (std::size_t n = 0; n < kTravelSamples + kHoldSamples; ++n) {
    host.wait(kSampling);
    const auto state = host.state_2();
    const auto error = static_cast<std::int16_t>(state.encoder_counts - target_counts);
    log.samples.push_back({state.speed_dps, std::round(state.iq_A / kIqLsb_A), error});
  }
  const auto cruise_over = [&](const Sample& s) {
    return std::abs(s.speed_dps) < 0.8 * kLimit_dps;
  };
  const auto begin = log.samples.begin() + 40;
  log.stop_begins = static_cast<std::size_t>(std::find_if(begin, log.samples.end(), cruise_over) -
                                             log.samples.begin());
  return log;
}

std::vector<double> pick(const Log& log, std::size_t from, std::size_t to, double Sample::*field) {
  std::vector<double> values;
  for (std::size_t n = from; n < to; ++n) values.push_back(log.samples.at(n).*field);
  return values;
}

class RealDrive : public ::testing::TestWithParam<std::uint64_t> {
 protected:
  const Log log_ = move_and_log(GetParam());
  /// Well after the start has settled and well before the stop.
  std::vector<double> cruise(double Sample::*field) const {
    return pick(log_, 16, log_.stop_begins - 4, field);
  }
};

/// The log has −64, −450 and −561 dps in three samples, 24 ms from the first to the last; a sample
/// of 12 ms more or less.
TEST_P(RealDrive, StartsLikeTheLog) {
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
TEST_P(RealDrive, OvershootsLikeTheLog) {
  double most = 0;
  for (std::size_t n = 0; n < 13; ++n) most = std::max(most, -log_.samples[n].speed_dps);
  EXPECT_GE(most, kLimit_dps + 2 * 22);
  EXPECT_LE(most, 1.30 * kLimit_dps);
}

/// The log: mean −574 dps, standard deviation 22 dps; iq mean −14 LSB, mostly friction, deviation
/// 8; and −0.17 to −0.24 LSB per dps between the two, to which a move of 70 samples adds the error
/// of its fit: 5 LSB of noise over 22 dps and √70, 0.03, thrice.
TEST_P(RealDrive, CruisesLikeTheLog) {
  const std::vector<double> speed_dps = cruise(&Sample::speed_dps);
  const std::vector<double> iq_lsb = cruise(&Sample::iq_lsb);
  EXPECT_NEAR(mean(speed_dps), -kLimit_dps, 0.01 * kLimit_dps);
  EXPECT_NEAR(deviation(speed_dps), 21.7, 0.2 * 21.7);
  EXPECT_NEAR(mean(iq_lsb), -14, 0.2 * 14);
  EXPECT_NEAR(deviation(iq_lsb), 8.0, 0.35 * 8.0);
  EXPECT_GE(slope(speed_dps, iq_lsb), -0.24 - 0.09);
  EXPECT_LE(slope(speed_dps, iq_lsb), -0.17 + 0.09);
}

/// The log: full speed 3.9° before the target, −18 dps one sample later. Its overshoot is 4 counts;
/// with the arm of these tests it is a third of a degree of the rotor more, which is not explained.
TEST_P(RealDrive, StopsLikeTheLog) {
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
TEST_P(RealDrive, HoldsLikeTheLog) {
  for (std::size_t n = kTravelSamples; n < log_.samples.size(); ++n) {
    EXPECT_LE(std::abs(log_.samples[n].error_counts), 1) << "sample " << n;
  }
  const auto last = log_.samples.size();
  const double iq_noise_lsb = noise(pick(log_, kTravelSamples, last, &Sample::iq_lsb));
  EXPECT_GE(iq_noise_lsb, 3.5);
  EXPECT_LE(iq_noise_lsb, 6);
  const auto speed_dps = pick(log_, kTravelSamples, last, &Sample::speed_dps);
  EXPECT_LE(deviation(speed_dps), 3.6);
  for (const double dps : speed_dps) {
    const double steps = dps / (360.0 / 65536 / 1e-3);
    EXPECT_LE(std::abs(steps - std::round(steps)), 0.5 / 5.4) << dps << " dps, shown in whole ones";
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, RealDrive, ::testing::Range<std::uint64_t>(1, 13));

/// Over all of them, as the log's three joints. Speed 0 in 75 to 95 % of the samples at rest; the
/// log's autocorrelation at cruise is −0.51, several tones: one alone, at 28 a turn, has −0.94.
TEST(RealDrives, HaveTheTextureOfTheLog) {
  std::size_t zero = 0;
  std::size_t all = 0;
  double correlation = 0;
  constexpr int kSeeds = 12;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const Log log = move_and_log(seed);
    const auto rest = pick(log, kTravelSamples, log.samples.size(), &Sample::speed_dps);
    zero += static_cast<std::size_t>(std::count(rest.begin(), rest.end(), 0.0));
    all += rest.size();
    correlation += autocorrelation(pick(log, 16, log.stop_begins - 4, &Sample::speed_dps)) / kSeeds;
  }
  EXPECT_GE(static_cast<double>(zero), 0.75 * static_cast<double>(all));
  EXPECT_LE(static_cast<double>(zero), 0.95 * static_cast<double>(all));
  EXPECT_GE(correlation, -0.6);
  EXPECT_LE(correlation, -0.4);
}

/// A loaded joint of the log swings at 12.0 Hz after a stop, dying away with 0.30 s. What hung
/// there is not known: 0.02 kg·m² (assumed). Half-periods in whole samples of 12 ms: 1 Hz.
TEST(RealDrives, RingWithALoad) {
  const Log log = move_and_log(1, 0.02);
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

/// How a host finds the end stops of MG4005 joints: it turns into one with 0xA2, and waits until iq
/// is above a threshold. Both hosts have been seen to work, with 0x31 before: speed Kp 30, Ki 0,
/// 750 dps, 4.0 A; and an older one Kp 10, 1000 dps, 1.0 A.
TEST(RealMg4005, PushesIntoAStopAsItsHostsExpect) {
  struct Calibration {
    std::uint8_t speed_kp;
    double speed_dps, least_A;
  };
  for (const Calibration& c : {Calibration{30, 750, 4.0}, Calibration{10, 1000, 1.0}}) {
    emulator::ServoConfig servo;
    servo.id = 1;
    servo.profile = profile("mg4005");
    servo.rom = servo.profile.factory;
    servo.rom.gains = {0, 0, c.speed_kp, 0, 60, 40};
    servo.boot_angle_deg = 0;
    servo.profile.drive.load.theta_max = 0.5;
    Host host(servo);
    host.wait(milliseconds(200));
    for (int n = 0; n < 100; ++n) {
      host.get<protocol::State2>(protocol::Speed{.speed_dps = c.speed_dps});
      host.wait(milliseconds(10));
    }
    const auto held = host.state_2();
    EXPECT_EQ(held.speed_dps, 0) << "at the stop";
    EXPECT_GT(held.iq_A, c.least_A) << "speed Kp " << int{c.speed_kp};
  }
}

/// A log of an MS4015 at 19 V, speed gains 50/20: from −44 to 600 dps, on its way to 720 dps, in at
/// most 4 ms. Its power, of the largest voltage, is 164 ‰ at most, and 94 to 120 ‰ when it cruises;
/// the emulated one may be a fifth off the most, which the log's samples need not have met.
TEST(RealMs4015, ChangesItsSpeedLikeTheLog) {
  emulator::ServoConfig servo;
  servo.id = 1;
  servo.profile = profile("ms4015");
  servo.rom = servo.profile.factory;
  Host host(servo);
  host.wait(milliseconds(200));
  host.get<protocol::State2>(protocol::Speed{.speed_dps = -44});
  host.wait(milliseconds(500));
  host.get<protocol::State2>(protocol::Speed{.speed_dps = 720});
  host.wait(milliseconds(4));
  constexpr double kDegPerRad = 180 / std::numbers::pi;
  EXPECT_GE(host.bus.truth(1).omega_out * kDegPerRad, 600);
  host.wait(milliseconds(300));

  double most = 0;
  for (int start = 0; start < 8; ++start) {  // from different places between two cogs
    host.get<protocol::State2>(protocol::Speed{.speed_dps = -44});
    host.wait(milliseconds(500 + 13 * start));
    host.get<protocol::State2>(protocol::Speed{.speed_dps = 720});
    for (int n = 0; n < 20; ++n) {
      host.wait(std::chrono::microseconds(500));
      most = std::max(most, host.state_2().power_permille / 1000.0);
    }
  }
  EXPECT_NEAR(most, 0.164, 0.2 * 0.164);
  std::vector<double> power;
  std::vector<double> speed_dps;
  for (int n = 0; n < 200; ++n) {
    host.wait(milliseconds(7));
    const auto state = host.state_2();
    power.push_back(state.power_permille / 1000.0);
    speed_dps.push_back(state.speed_dps);
  }
  EXPECT_GE(mean(power), 0.094);
  EXPECT_LE(mean(power), 0.120);
  // 26 ripples a turn, as seen; the loops' stiffness at 52 Hz is not: a fifth.
  EXPECT_NEAR(deviation(speed_dps), 79, 0.2 * 79);
}

}  // namespace real_drive_test
}  // namespace lk::test
