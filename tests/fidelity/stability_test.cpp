/// @file Factory gains bring every motor to rest, with loads of up to ten rotor inertias.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "emulator/core/servo/lane.hpp"
#include "tests/fidelity/drives.hpp"

namespace lk::test {
namespace stability_test {

constexpr std::size_t kSeeds = 200;
constexpr double kMove_rad = 1.0;  // of the rotor
constexpr double kAtRest_rad =
    0.01;  // 0.6°: a position that holds against cogging still moves less

/// Returns how far a shaft still moves 3 s after a move, rad of the rotor: the largest of all
/// specimens and loads.
double unrest_rad(const std::string& motor, const std::string& generation) {
  std::vector<model::DriveInit> inits;
  const emulator::Profile type = profile(motor);
  for (std::size_t seed = 1; seed <= kSeeds; ++seed) {
    emulator::ServoConfig servo = delivered(motor, generation, type);
    const model::MechanicsParams& m = servo.profile.drive.mechanics;
    const double rotors = 10.0 * static_cast<double>(seed - 1) / (kSeeds - 1);
    servo.profile.drive.load.J = rotors * m.J * m.gear_ratio * m.gear_ratio;
    inits.push_back(emulator::make_drive(servo, seed));
  }
  model::DriveBank bank(inits);
  const auto ticks = [&](double seconds) {
    return static_cast<std::int64_t>(seconds * inits.front().params.inverter.f_pwm);
  };
  bank.advance(ticks(0.2));
  for (std::size_t n = 0; n < kSeeds; ++n) {
    bank.command(n, model::Position{bank.truth(n).theta_m + kMove_rad});
  }
  bank.advance(ticks(3));
  std::vector<double> low(kSeeds, 1e9), high(kSeeds, -1e9);
  for (int step = 0; step < 250; ++step) {
    bank.advance(ticks(0.002));
    for (std::size_t n = 0; n < kSeeds; ++n) {
      low[n] = std::min(low[n], bank.truth(n).theta_m);
      high[n] = std::max(high[n], bank.truth(n).theta_m);
    }
  }
  double most = 0;
  for (std::size_t n = 0; n < kSeeds; ++n) most = std::max(most, high[n] - low[n]);
  return most;
}

TEST(FactoryGains, BringEveryMotorToRest) {
  for (const std::string& motor : motor_names()) {
    EXPECT_LT(unrest_rad(motor, "v236"), kAtRest_rad) << motor;
    const emulator::Series series = profile(motor).series;
    if (series != emulator::Series::kMf && series != emulator::Series::kMh) continue;
    EXPECT_LT(unrest_rad(motor, "legacy"), kAtRest_rad) << motor << ", slow current loop";
  }
}

}  // namespace stability_test
}  // namespace lk::test
