// No drive of a delivered robot oscillates after a move: its current settles.
#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "emulator/config/config.hpp"
#include "emulator/core/servo/registers.hpp"
#include "model/drive_bank.hpp"
#include "tests/support/robot.hpp"

namespace lk::emulator {
namespace settling_test {

using test::robot;

/// Returns the current for the rated torque; without a rating, a tenth of the sensor range.
double rated_current_A(const Profile& profile) {
  const model::DriveParams& d = profile.drive;
  const double k_t = 1.5 * d.motor.pole_pairs * d.motor.psi_f;
  const double tau = profile.rating.torque_rated_Nm;
  return tau > 0 ? tau / (d.mechanics.gear_ratio * d.mechanics.gear_efficiency * k_t)
                 : 0.1 * d.current_sensor.range;
}

/// Returns the peak-to-peak current in A, one second after a target step of the output. Without
/// sensor noise, which exists before the step too.
double ripple_after_step_A(const ServoConfig& servo, double step_deg) {
  model::DriveInit init{servo.profile.drive, control_settings(servo.rom), 1, 0.0};
  model::DriveParams& d = init.params;
  d.encoder.noise = d.current_sensor.noise = 0.0;
  d.brake.tau = 0.0;
  const double rad = std::numbers::pi / 180;
  init.theta_m = servo.boot_angle_deg.value_or(0.0) * rad;
  model::DriveBank bank(std::span(&init, 1));
  const auto f = static_cast<std::int64_t>(d.inverter.f_pwm);
  bank.advance(f / 2);           // a joint falls to its resting position
  const double clear = 1 * rad;  // of the end stops
  const double target = std::clamp(bank.truth(0).theta_out + step_deg * rad,
                                   d.load.theta_min + clear, d.load.theta_max - clear);
  bank.command(0, model::Position{target * d.mechanics.gear_ratio});
  bank.advance(f);
  double low = bank.truth(0).i_q;
  double high = low;
  for (std::int64_t n = 0; n < f / 4; n += 5) {  // 5 periods: not a multiple of the loops' periods
    bank.advance(5);
    low = std::min(low, bank.truth(0).i_q);
    high = std::max(high, bank.truth(0).i_q);
  }
  return high - low;
}

class Settling : public testing::TestWithParam<const char*> {};

TEST_P(Settling, EveryDriveIsQuietASecondAfterAStep) {
  for (const BusConfig& bus : robot(GetParam())) {
    for (const ServoConfig& servo : bus.servos) {
      for (const double step_deg : {1.0, 10.0, -30.0}) {
        EXPECT_LT(ripple_after_step_A(servo, step_deg), 0.05 * rated_current_A(servo.profile))
            << bus.interface << " drive " << servo.id << ", step of " << step_deg << " deg";
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Delivered, Settling,
                         testing::Values("bench", "example", "gimbal", "mixed", "quadruped",
                                         "turntable"));

}  // namespace settling_test
}  // namespace lk::emulator
