// Torque, energy, friction, faults and poses at a joint between a drive and a body.

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>

#include "emulator/core/servo/signals.hpp"
#include "tests/emulator/coupling/coupling_support.hpp"

namespace lk::test {
namespace joint_test {

using emulator::JointState;
using emulator::ServoConfig;

std::shared_ptr<HandBody> inertia_body(double J, double tau = 0, double angle_rad = 0) {
  return std::make_shared<HandBody>(1, linear_inertia(J, tau), kMs, Two{angle_rad, 0});
}

std::shared_ptr<HandBody> pendulum_body(double J, double mgl, double angle_rad) {
  return std::make_shared<HandBody>(1, pendulum(J, mgl), kMs, Two{angle_rad, 0});
}

/// Expects that the drive's supply covers its losses, its load and what it has stored since.
void expect_balance(const model::EnergyLedger& e, double stored_before) {
  EXPECT_NEAR(e.supply,
              e.copper + e.inverter + e.friction + e.gear + e.load + e.stored - stored_before,
              1e-6 * e.supply);
}

TEST(Joint, AddsTheRotorInertiaOnce) {
  const double J_body = 0.02;
  OnBody run(inertia_body(J_body), geared_drive(10));
  run.torque_current(1.0);
  run.advance(0.05);
  const double omega = run.truth().omega_out;
  double tau_e = 0;  // mean
  for (int n = 0; n < 1000; ++n) {
    run.advance(0.0001);
    tau_e += run.truth().tau_e / 1000;
  }
  const model::MechanicsParams m = geared_drive(10).profile.drive.mechanics;
  const double J = 100 * m.J + m.J_out + J_body;
  EXPECT_GT(tau_e, 0.05);
  EXPECT_NEAR((run.truth().omega_out - omega) / 0.1, 10 * tau_e / J, 1e-3 * 10 * tau_e / J);
}

/// The drive's output energy is the body's input: 0.1 % of the total.
TEST(Joint, ConservesEnergy) {
  const double mgl = 0.6;
  OnBody run(pendulum_body(0.02, mgl, 0.5), geared_drive(10));
  const double before = run.body().energy_J();
  const double stored_before = run.energy().stored;
  double through = 0;
  double last = before;
  for (int n = 0; n < 500; ++n) {
    if (n % 50 == 0) run.torque_current(n % 100 == 0 ? 0.8 : -0.8);
    run.advance(0.001);
    through += std::abs(run.body().energy_J() - last);
    last = run.body().energy_J();
  }
  const model::EnergyLedger e = run.energy();
  expect_balance(e, stored_before);
  // The drive's energy uses the inertia that it feels, the body's that of the armature.
  const model::MechanicsParams m = geared_drive(10).profile.drive.mechanics;
  const double omega = run.body().speeds()[0];
  const double armature = 0.5 * (100 * m.J + m.J_out) * omega * omega;
  const double seen = 0.5 * 0.02 * omega * omega;
  EXPECT_GT(through, 0.3);
  EXPECT_NEAR(e.load + seen, run.body().energy_J() - armature - before, 1e-3 * through);
}

/// A free joint satisfies I·(ω now − ω one step before) = torque·step, within one row.
TEST(Joint, ReportsTheTorqueOfTheLastStep) {
  const double J_body = 0.02;
  OnBody run(inertia_body(J_body), geared_drive(10));
  run.advance(0.0015);  // rows lie between the ends of steps
  double before = run.view().joint.speed_rad_s;
  for (int n = 0; n < 50; ++n) {
    run.torque_current(0.05 * n);  // a different torque in each step
    run.advance(0.001);
    const JointState now = run.view().joint;
    EXPECT_NEAR(now.torque_Nm * 1e-3, J_body * (now.speed_rad_s - before), 1e-12) << n;
    before = now.speed_rad_s;
  }
  EXPECT_GT(before, 0.5);
}

TEST(Joint, HoldsUpToTheStaticFriction) {
  ServoConfig servo = servo_config(1);
  servo.profile.drive.mechanics.tau_coulomb = 0.05;
  servo.profile.drive.mechanics.tau_static = 0.06;
  OnBody held(pendulum_body(0.01, 0.1, 0.5), servo);  // holds 0.048 Nm
  held.advance(2);
  EXPECT_NEAR(held.body().angles()[0], 0.5, 1e-12);
  OnBody slips(pendulum_body(0.01, 0.1, 0.7), servo);  // 0.064 Nm
  slips.advance(2);
  EXPECT_LT(slips.body().angles()[0], 0.6);
}

/// The rotor keeps turning alone; the arm falls as if it had no drive.
TEST(Joint, SwingsFreelyAfterTheCouplingBreaks) {
  for (const double stiffness : {0.0, 4500.0}) {
    ServoConfig servo = geared_drive(10);
    servo.profile.drive.mechanics.gear_stiffness_out = stiffness;
    servo.profile.drive.mechanics.tau_coulomb = 0.5;  // holds the arm
    const double mgl = 0.6;
    const double J = 0.02;
    OnBody run(pendulum_body(J, mgl, 0.1), servo);
    run.advance(0.1);
    EXPECT_NEAR(run.body().angles()[0], 0.1, 2e-3);
    const double rotor = run.truth().theta_m;
    run.fault("coupling_broken");
    // Half a period of a small oscillation, from one side to the other; the flange moves along.
    const double omega = std::sqrt(mgl / (J + 1e-4));
    run.advance(3.14159265 / omega);
    EXPECT_NEAR(run.body().angles()[0], -0.1, 2e-3) << stiffness;
    EXPECT_NEAR(run.truth().theta_m, rotor, 0.05) << stiffness;
    run.clear_faults();  // couples at the present angles
    run.advance(0.2);
    EXPECT_NEAR(run.body().angles()[0], -0.1, 5e-3) << stiffness;
    EXPECT_NEAR(run.truth().theta_m, rotor, 0.1) << stiffness;
  }
}

TEST(Joint, StopsAtAnEndStopOfTheDrive) {
  OnBody run(pendulum_body(0.02, 0.6, 1), servo_config(1));
  run.fault("end_stop", {-30.0, 1e6});  // degrees relative to the present angle
  double least = 1;
  for (int n = 0; n < 1000; ++n) {
    run.advance(0.001);
    least = std::min(least, run.body().angles()[0]);
  }
  EXPECT_NEAR(least, 1.0 - 3.14159265 / 6, 1e-4);
}

constexpr double kHanging_Nm = 0.6;
constexpr double kArm_kg_m2 = 0.02;

/// Returns how far an arm falls in a time, with the drive's rotor.
double fall_rad(const ServoConfig& servo, double seconds) {
  const model::MechanicsParams& m = servo.profile.drive.mechanics;
  const double J = kArm_kg_m2 + m.J_out + m.gear_ratio * m.gear_ratio * m.J;
  return 0.5 * kHanging_Nm / J * seconds * seconds;
}

/// A brake of 2 Nm at the output is released for 100 ms. It then stops the arm after a further
/// angle: the fall times the ratio of the torques.
TEST(Joint, FallsFurtherWithALateBrake) {
  const auto sag = [](double late_s) {
    ServoConfig servo = geared_drive(10);
    servo.profile.drive.brake = {.tau = 0.2, .engage_time = 1e-4, .release_time = 1e-4};
    servo.quirks.dialect.brake_command = true;
    OnBody run(inertia_body(kArm_kg_m2, kHanging_Nm), servo);
    run.advance(0.1);
    EXPECT_NEAR(run.body().angles()[0], 0, 1e-9);  // held
    run.send(protocol::Brake{protocol::kBrakeRelease});
    run.advance(0.05);
    if (late_s > 0) run.fault("brake_late", {late_s * 1e3});
    run.advance(0.05);
    run.send(protocol::Brake{protocol::kBrakeEngage});
    run.advance(1);
    EXPECT_NEAR(run.body().speeds()[0], 0, 1e-6);
    return run.body().angles()[0];
  };
  const ServoConfig servo = geared_drive(10);
  const double stop = 2.0 / (2.0 - kHanging_Nm);
  EXPECT_NEAR(sag(0), stop * fall_rad(servo, 0.1), 0.03 * fall_rad(servo, 0.1));
  EXPECT_NEAR(sag(0.1), stop * fall_rad(servo, 0.2), 0.03 * fall_rad(servo, 0.2));
}

/// 0x80 to a drive that holds an arm: the arm falls, with only the rotor's inertia added.
TEST(Joint, FallsFreelyAfter0x80) {
  OnBody run(inertia_body(kArm_kg_m2, kHanging_Nm), geared_drive(10));
  run.send(protocol::Speed{});
  run.advance(0.5);
  const double held = run.body().angles()[0];
  EXPECT_NEAR(run.body().speeds()[0], 0, 0.02);
  run.advance(0.1);
  EXPECT_NEAR(run.body().angles()[0], held, 2e-3);
  const double speed = run.body().speeds()[0];
  run.send(protocol::Off{});
  run.advance(0.1);
  const double fallen = run.body().angles()[0] - held - 0.1 * speed;
  EXPECT_NEAR(fallen, fall_rad(geared_drive(10), 0.1), 0.05 * fallen);
}

// --- a body that is moved to a pose: its drives move with it, at rest

double read(const OnBody& run, const char* signal) {
  return emulator::find_signal(signal)->read(run.view());
}

/// 1.2 rad at the output of a 10:1 gear are 12 rad at the rotor: nearly two turns, which the drive
/// has counted.
TEST(BodyPose, MovesTheDriveAndItsReadings) {
  for (const double stiffness : {0.0, 50.0, 4500.0}) {
    auto servo = geared_drive(10);
    servo.profile.drive.mechanics.gear_stiffness_out = stiffness;
    OnBody run(inertia_body(0.02, 0, 0.1), servo);
    run.torque_current(0.5);
    run.advance(0.05);
    EXPECT_GT(std::abs(run.truth().omega_out), 0.1) << stiffness;
    run.torque_current(0);
    run.advance(0.01);
    const double twist = run.truth().theta_m / 10 - run.truth().theta_out;
    const double known_deg = read(run, "angle_deg");
    const double before = run.truth().theta_m;
    run.move_body(1.2);
    run.advance(0.001);
    EXPECT_NEAR(run.body().angles()[0], 1.2, 1e-3) << stiffness;
    EXPECT_NEAR(run.truth().theta_out, 1.2, std::abs(twist) + 1e-3) << stiffness;
    EXPECT_NEAR(run.truth().omega_m, 0, stiffness == 0 ? 1e-9 : 2) << stiffness;
    const double turned_deg = (run.truth().theta_m - before) * 180 / std::numbers::pi;
    EXPECT_GT(turned_deg, 500) << stiffness;
    EXPECT_NEAR(read(run, "angle_deg") - known_deg, turned_deg, 0.1) << stiffness;
    run.advance(0.01);  // its speed is a mean over 3.4 ms
    EXPECT_NEAR(read(run, "speed_dps"), 0, 2 * kSpeedStep_dps + (stiffness == 0 ? 0 : 120));
    run.advance(0.2);
    EXPECT_NEAR(run.body().angles()[0], 1.2, 0.01) << stiffness;  // and stays
  }
}

/// A drive that holds a position returns to it.
TEST(BodyPose, KeepsTheSetPointOfTheDrive) {
  OnBody run(inertia_body(0.001), geared_drive(10));
  run.send(protocol::Speed{});
  run.advance(0.1);
  const double angle_deg = read(run, "angle_deg");
  run.send(protocol::Position1{.target_cdeg = std::lround(100 * angle_deg)});
  run.advance(0.5);
  run.move_body(0.2);
  run.advance(0.002);
  EXPECT_NEAR(run.body().angles()[0], 0.2, 0.02);
  run.advance(3);
  EXPECT_NEAR(run.body().angles()[0], 0, 0.02);
}

/// The energy balance holds: the move counts as work of the load.
TEST(BodyPose, CountsAsWorkOfTheLoad) {
  OnBody run(inertia_body(0.02), geared_drive(10));
  const double stored = run.energy().stored;
  run.torque_current(1);
  run.advance(0.1);
  run.move_body(-1);
  run.advance(0.1);
  expect_balance(run.energy(), stored);
}

/// The rotor behind a broken coupling does not move.
TEST(BodyPose, LeavesARotorBehindABrokenCoupling) {
  OnBody run(inertia_body(0.02), geared_drive(10));
  run.fault("coupling_broken");
  run.advance(0.01);
  const double rotor = run.truth().theta_m;
  run.move_body(0.7);
  run.advance(0.01);
  EXPECT_NEAR(run.body().angles()[0], 0.7, 1e-9);
  EXPECT_NEAR(run.truth().theta_out, 0.7, 1e-9);
  EXPECT_EQ(run.truth().theta_m, rotor);
}

}  // namespace joint_test
}  // namespace lk::test
