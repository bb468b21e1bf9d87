/// @file Every motor holds its printed rated torque, warm, with factory settings.

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <numbers>

#include "emulator/core/generation.hpp"
#include "tests/fidelity/drives.hpp"
#include "tests/support/test_bus.hpp"

namespace lk::test {
namespace holding_test {

/// Returns the angle of the output after 60 s under the rated torque, from where it was told to
/// stay, deg. The motor starts at 60 °C.
double moved_deg(const std::string& motor, const std::string& generation) {
  emulator::ServoConfig servo = delivered(motor, generation);
  servo.boot_angle_deg = 45;
  servo.boot_temperature_C = 60;
  Host host(servo);
  host.wait(std::chrono::milliseconds(200));
  host.get<protocol::State2>(protocol::Position1{.target_cdeg = host.multi_turn_cdeg()});
  const double before = host.bus.truth(1).theta_out;
  // The torque grows within a second: how far a sudden one moves the shaft is another question.
  for (int n = 1; n <= 20; ++n) {
    model::LoadParams load;
    load.tau = -servo.profile.rating.torque_rated_Nm * n / 20;
    host.bus.set_load(1, load);
    host.wait(std::chrono::milliseconds(50));
  }
  host.wait(std::chrono::seconds(59));
  constexpr double kCount_dps = 17;  // of the reported speed, at most
  EXPECT_LE(std::abs(host.state_2().speed_dps), kCount_dps) << motor << " " << generation;
  return (host.bus.truth(1).theta_out - before) * 180 / std::numbers::pi;
}

/// 1°: more than a cog of any of the motors would still be "held".
TEST(RatedTorque, IsHeldForAMinute) {
  std::size_t checked = 0;
  for (const std::string& motor : motor_names()) {
    if (profile(motor).rating.torque_rated_Nm == 0) continue;
    for (const std::string& generation : emulator::generation_names()) {
      EXPECT_NEAR(moved_deg(motor, generation), 0, 1) << motor << " " << generation;
      ++checked;
    }
  }
  EXPECT_GE(checked, 50U);
}

}  // namespace holding_test
}  // namespace lk::test
