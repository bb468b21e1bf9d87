// Figures derived from a profile: a motor with round numbers, computed by hand.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "emulator/config/motor_file.hpp"

namespace lk::emulator {
namespace motor_figures_test {

using std::numbers::pi;

constexpr double kExact = 1e-9;  // rounding only

/// 10 pole pairs of 10 mWb: k_t = 3/2·10·0.01 = 0.15 Nm/A. A gear of 2 makes 4e-3 kg·m² at the
/// output 1e-3 at the rotor, 2e-3 with the rotor's own. Half an ohm, and 24 V.
Profile round_motor() {
  Profile profile;
  model::DriveParams& d = profile.drive;
  d.motor.pole_pairs = 10;
  d.motor.psi_f = 0.01;
  d.motor.R_s = 0.4;
  d.motor.L_q = 1e-3;
  d.inverter.R_on = 0.1;
  d.inverter.t_dead = 0;
  d.inverter.duty_max = 1;
  d.supply.v_source = 24;
  d.current_sensor.range = 20;
  d.mechanics = {.J = 1e-3, .gear_ratio = 2, .gear_efficiency = 0.9, .J_out = 4e-3};
  d.mechanics.B = d.mechanics.tau_coulomb = d.mechanics.tau_static = 0;
  d.mechanics.tau_coulomb_out = 0;
  // At the reference bytes the loops have the bandwidths of the profile.
  d.control.has_current_loop = true;
  d.control.current_bandwidth = 2 * pi * 1000;
  d.control.speed_bandwidth = 2 * pi * 100;
  d.control.J_nominal = 2e-3;
  d.control.angle_kp_per_byte = 2 * pi * 10 / 50;
  profile.factory.gains.current_kp = static_cast<std::uint8_t>(d.control.ref_current_byte);
  profile.factory.gains.speed_kp = static_cast<std::uint8_t>(d.control.ref_speed_kp_byte);
  profile.factory.gains.angle_kp = 50;
  return profile;
}

TEST(MotorFigures, MatchClosedForms) {
  const MotorFigures f = motor_figures(round_motor());
  EXPECT_NEAR(f.k_t_Nm_A, 0.15, kExact);
  // 24 V/√3 of back-EMF per phase: 138.6 rad/s of the rotor, half of it at the output.
  EXPECT_NEAR(f.no_load_speed_rpm, 24 / std::sqrt(3.0) / 0.1 / 2 * 30 / pi, 1e-6);
  EXPECT_NEAR(f.stall_current_A, 20, kExact) << "27.7 A would flow, the sensor ends before";
  EXPECT_NEAR(f.stall_torque_Nm, 20 * 0.15 * 2 * 0.9, kExact);
  EXPECT_NEAR(f.electrical_time_constant_ms, 2, kExact);
  EXPECT_NEAR(f.mechanical_time_constant_ms, 0.5 * 2e-3 / (1.5 * 0.1 * 0.1) * 1000, kExact);
}

TEST(MotorFigures, LimitStallBySupplyAndFriction) {
  Profile profile = round_motor();
  profile.drive.current_sensor.range = 100;
  profile.drive.mechanics.tau_static = 0.1;
  profile.drive.mechanics.tau_coulomb_out = 0.2;
  const MotorFigures f = motor_figures(profile);
  const double stall_A = 24 / std::sqrt(3.0) / 0.5;
  EXPECT_NEAR(f.stall_current_A, stall_A, kExact);
  EXPECT_NEAR(f.stall_torque_Nm, (0.15 * stall_A - 0.1) * 2 * 0.9 - 0.2, kExact);
  profile.drive.mechanics.tau_static = 1000;
  EXPECT_EQ(motor_figures(profile).stall_torque_Nm, 0) << "it does not turn, nor backwards";
}

TEST(MotorFigures, ComputeBandwidthsFromFactoryGains) {
  Profile profile = round_motor();
  const MotorFigures f = motor_figures(profile);
  EXPECT_NEAR(f.current_bandwidth_Hz, 1000, 1e-6);
  EXPECT_NEAR(f.speed_bandwidth_Hz, 100, 1e-6);
  EXPECT_NEAR(f.position_bandwidth_Hz, 10, 1e-6);
  profile.drive.mechanics.J_out = 12e-3;  // doubles the inertia
  EXPECT_NEAR(motor_figures(profile).speed_bandwidth_Hz, 50, 1e-6);
  profile.drive.control.has_current_loop = false;
  EXPECT_EQ(motor_figures(profile).current_bandwidth_Hz, 0);
}

}  // namespace motor_figures_test
}  // namespace lk::emulator
