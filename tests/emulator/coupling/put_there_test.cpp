// A body that is moved to a pose: its drives move with it, at rest.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>

#include "emulator/core/servo/signals.hpp"
#include "tests/emulator/coupling/on_body.hpp"

namespace lk::test {
namespace put_there_test {

double read(const OnBody& run, const char* signal) {
  return emulator::find_signal(signal)->read(run.view());
}

/// 1.2 rad at the output of a 10:1 gear are 12 rad at the rotor: nearly two turns, which the drive
/// has counted.
TEST(PutThere, TheDriveIsThereAndKnowsIt) {
  for (const double stiffness : {0.0, 50.0, 4500.0}) {
    auto servo = geared_drive(10);
    servo.profile.drive.mechanics.gear_stiffness_out = stiffness;
    OnBody run(std::make_shared<HandBody>(1, linear_inertia(0.02), kMs, Two{0.1, 0}), servo);
    run.torque_current(0.5);
    run.advance(0.05);
    EXPECT_GT(std::abs(run.truth().omega_out), 0.1) << stiffness;
    run.torque_current(0);
    run.advance(0.01);
    const double twist = run.truth().theta_m / 10 - run.truth().theta_out;
    const double known_deg = read(run, "angle_deg");
    const double before = run.truth().theta_m;
    run.put(1.2);
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
TEST(PutThere, ADriveDoesWhatItWasTold) {
  OnBody run(std::make_shared<HandBody>(1, linear_inertia(0.001), kMs), geared_drive(10));
  run.say(protocol::Speed{});
  run.advance(0.1);
  const double angle_deg = read(run, "angle_deg");
  run.say(protocol::Position1{.target_cdeg = std::lround(100 * angle_deg)});
  run.advance(0.5);
  run.put(0.2);
  run.advance(0.002);
  EXPECT_NEAR(run.body().angles()[0], 0.2, 0.02);
  run.advance(3);
  EXPECT_NEAR(run.body().angles()[0], 0, 0.02);
}

/// The energy balance holds: the move counts as work of the load.
TEST(PutThere, TheEnergyIsTheLoads) {
  OnBody run(std::make_shared<HandBody>(1, linear_inertia(0.02), kMs), geared_drive(10));
  const double stored = run.energy().stored;
  run.torque_current(1);
  run.advance(0.1);
  run.put(-1);
  run.advance(0.1);
  const model::EnergyLedger e = run.energy();
  EXPECT_NEAR(e.supply, e.copper + e.inverter + e.friction + e.gear + e.load + e.stored - stored,
              1e-6 * e.supply);
}

/// The rotor behind a broken coupling does not move.
TEST(PutThere, NotBehindABrokenCoupling) {
  OnBody run(std::make_shared<HandBody>(1, linear_inertia(0.02), kMs), geared_drive(10));
  run.fault("coupling_broken");
  run.advance(0.01);
  const double rotor = run.truth().theta_m;
  run.put(0.7);
  run.advance(0.01);
  EXPECT_NEAR(run.body().angles()[0], 0.7, 1e-9);
  EXPECT_NEAR(run.truth().theta_out, 0.7, 1e-9);
  EXPECT_EQ(run.truth().theta_m, rotor);
}

}  // namespace put_there_test
}  // namespace lk::test
