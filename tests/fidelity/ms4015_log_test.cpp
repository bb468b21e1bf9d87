/// @file The log of an MS4015 on RS-485, 754 exchanges.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "tests/fidelity/record_range.hpp"
#include "tests/fidelity/statistics.hpp"
#include "tests/support/profile.hpp"
#include "tests/support/test_bus.hpp"

namespace lk::test {
namespace ms4015_log_test {

using std::chrono::milliseconds;

/// The log of an MS4015 at 19 V, speed gains 50/20: −44 to 600 dps, on the way to 720, takes at
/// most 4 ms. Power relative to the largest voltage: at most 164 ‰, and 94 to 120 ‰ at cruise.
/// Tolerance of the maximum is a fifth, since the log's samples may have missed it.
TEST(Ms4015, ChangesItsSpeedLikeTheLog) {
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
  for (int start = 0; start < 8; ++start) {  // from different positions between two cogs
    host.get<protocol::State2>(protocol::Speed{.speed_dps = -44});
    host.wait(milliseconds(500 + 13 * start));
    host.get<protocol::State2>(protocol::Speed{.speed_dps = 720});
    for (int n = 0; n < 20; ++n) {
      host.wait(std::chrono::microseconds(500));
      most = std::max(most, host.state_2().power_permille / 1000.0);
    }
  }
  record_range("largest power", {most});
  EXPECT_NEAR(most, 0.164, 0.2 * 0.164);
  std::vector<double> power;
  std::vector<double> speed_dps;
  std::vector<double> turns;
  for (int n = 0; n < 200; ++n) {
    host.wait(std::chrono::microseconds(6000 + 37 * (n * n % 53)));
    const auto state = host.state_2();
    turns.push_back(host.bus.truth(1).theta_out / (2 * std::numbers::pi));
    power.push_back(state.power_permille / 1000.0);
    speed_dps.push_back(state.speed_dps);
  }
  record_range("mean power", {mean(power)});
  record_range("deviation of the speed, dps", {deviation(speed_dps)});
  record_range("share of the slots' order", {spectral_share(turns, speed_dps, 24)});
  record_range("share of the poles' order", {spectral_share(turns, speed_dps, 26)});
  EXPECT_GE(mean(power), 0.094);
  EXPECT_LE(mean(power), 0.120);
  // Two stretches of the log: 79 and 56.7 dps; tolerance a fifth of their mean.
  EXPECT_NEAR(deviation(speed_dps), 68, 0.2 * 68);
  // The log's shares: 0.57 near the 24 slots, 0.19 near the 26 poles; the rest is unknown.
  EXPECT_NEAR(spectral_peak(turns, speed_dps, 5, 60), 24, 0.1);
  EXPECT_GE(spectral_share(turns, speed_dps, 24), 0.57);
  EXPECT_NEAR(spectral_share(turns, speed_dps, 26), 0.19, 0.1);
}

}  // namespace ms4015_log_test
}  // namespace lk::test
