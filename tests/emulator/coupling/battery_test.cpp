// Drives on a common battery: its inner resistance lowers each link by the current of all.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>

#include "tests/emulator/coupling/coupling_support.hpp"

namespace lk::test {
namespace battery_test {

using emulator::Scenario;
using emulator::ScenarioRun;
using emulator::ServoConfig;
using std::chrono::milliseconds;

constexpr double kV = 48.0;
constexpr double kCable_ohm = 0.05;

/// `drives` drives with clamped outputs.
Scenario clamped(int drives, double battery_R_ohm) {
  Scenario scenario;
  emulator::BusConfig bus;
  bus.interface = "test";
  for (int id = 1; id <= drives; ++id) {
    ServoConfig servo;
    servo.id = id;
    servo.profile = profile("mg8016");
    servo.rom = servo.profile.factory;
    servo.profile.drive.supply.v_source = kV;
    servo.profile.drive.supply.R_source = kCable_ohm;
    servo.profile.drive.load.J = 1e3;
    bus.servos.push_back(servo);
  }
  bus.battery_R_ohm = battery_R_ohm;
  scenario.robot = {bus};
  scenario.duration = std::chrono::seconds(10);
  return scenario;
}

void torque(ScenarioRun& run, int id, double iq_A) {
  const ServoConfig servo = clamped(1, 0).robot.front().servos.front();
  const auto format = protocol::wire_format(servo.quirks.dialect, servo.profile.series);
  run.receive(0,
              {milliseconds(100 + id), protocol::encode_query(id, protocol::Torque{iq_A}, format)});
}

/// Returns the power in W of a drive that holds `iq_A`: nearly all copper loss, at any voltage.
double power_W(double iq_A) {
  ScenarioRun run(clamped(1, 0));
  torque(run, 1, iq_A);
  run.advance_to(milliseconds(400));
  const double before_J = run.bus(0).state().drawn_J(1);
  run.advance_to(milliseconds(500));
  return (run.bus(0).state().drawn_J(1) - before_J) / 0.1;
}

/// Returns the voltage in V at which drive and resistances balance: v·(V − v)/R = P.
double link_V(double R_ohm, double P_W) {
  return 0.5 * (kV + std::sqrt(kV * kV - 4.0 * R_ohm * P_W));
}

TEST(Battery, CostsEachDriveWhatAllDraw) {
  constexpr double kIq_A = 20.0;
  constexpr double kBattery_ohm = 0.3;
  const double P_W = power_W(kIq_A);
  ScenarioRun run(clamped(4, kBattery_ohm));
  for (int id = 1; id <= 4; ++id) torque(run, id, kIq_A);
  run.advance_to(milliseconds(500));
  // Each drive's cable carries its own current, the battery four of them.
  const double expected_V = link_V(kCable_ohm + 4.0 * kBattery_ohm, P_W);
  EXPECT_LT(expected_V, 46.0);
  for (int id = 1; id <= 4; ++id) EXPECT_NEAR(run.bus(0).truth(id).v_bus, expected_V, 0.03);
}

TEST(Battery, IsFeltByADriveThatDrawsNothing) {
  ScenarioRun run(clamped(2, 1.0));
  run.advance_to(milliseconds(90));
  const double idle_V = run.bus(0).truth(2).v_bus;
  const double P_W = power_W(20.0);
  torque(run, 1, 20.0);
  run.advance_to(milliseconds(500));
  const double fell_V = idle_V - run.bus(0).truth(2).v_bus;
  const double draws_A = P_W / run.bus(0).truth(1).v_bus;
  EXPECT_NEAR(fell_V, draws_A * 1.0,
              0.05 * fell_V);  // P_W includes the electronics of the first drive
}

/// Link capacitors behind a large resistance. An estimate from the previous step's current would
/// oscillate for ever from R·C = h/2 on; here R·C is 16 h.
TEST(Battery, ItsVoltageDoesNotSwing) {
  ScenarioRun run(clamped(12, 3.0));
  torque(run, 1, 5.0);
  run.advance_to(milliseconds(200));
  double least = 1e9;
  double most = 0;
  for (int ms = 200; ms < 400; ++ms) {
    run.advance_to(milliseconds(ms));
    least = std::min(least, run.bus(0).truth(2).v_bus);
    most = std::max(most, run.bus(0).truth(2).v_bus);
  }
  EXPECT_LT(most - least, 0.1);
}

TEST(Battery, RunsAreTheSameHoweverTheyAreSliced) {
  ScenarioRun whole(clamped(3, 0.5));
  ScenarioRun sliced(clamped(3, 0.5));
  for (ScenarioRun* run : {&whole, &sliced}) torque(*run, 1, 15.0);
  whole.advance_to(milliseconds(300));
  ScenarioRun copy = sliced;
  for (int step = 1; step <= 600; ++step) {
    sliced.advance_to(std::chrono::microseconds(101'000 + 331 * step));
  }
  for (ScenarioRun* run : {&sliced, &copy}) run->advance_to(milliseconds(300));
  for (int id = 1; id <= 3; ++id) {
    EXPECT_EQ(sliced.bus(0).truth(id).v_bus, whole.bus(0).truth(id).v_bus);
    EXPECT_EQ(copy.bus(0).truth(id).v_bus, whole.bus(0).truth(id).v_bus);
  }
}

}  // namespace battery_test
}  // namespace lk::test
