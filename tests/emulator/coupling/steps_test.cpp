// The steps of bodies and batteries: order, slices, copies, and equality with plain loads.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>

#include "emulator/core/scenario/scenario_fleet.hpp"
#include "tests/emulator/coupling/coupling_support.hpp"
#include "tests/support/bus_config.hpp"

namespace lk::test {
namespace steps_test {

using emulator::Scenario;
using emulator::ScenarioFleet;
using emulator::ScenarioRun;
using emulator::ServoConfig;
using emulator::SimTime;

/// Two geared drives on a double pendulum with constant torque currents and smooth effects only.
Scenario smooth(SimTime step) {
  const auto body = std::make_shared<HandBody>(2, double_pendulum(0.3, 0.25), step, Two{0.6, -0.4});
  std::vector<ServoConfig> servos;
  for (int id = 1; id <= 2; ++id) {
    ServoConfig servo = servo_config(id);
    servo.profile.drive.mechanics.gear_ratio = 6;
    servo.profile.drive.mechanics.J = 2e-5;
    servo.profile.drive.mechanics.B = 2e-4;
    servo.profile.drive.inverter.timer_counts = 1e9;
    servo.profile.drive.encoder.bits = 18;
    servo.profile.drive.current_sensor.bits = 26;
    servo.joint = emulator::JointLink{.joint = static_cast<std::size_t>(id - 1)};
    servo.joint->start_rad = body->joint(servo.joint->joint).angle_rad;
    servos.push_back(servo);
  }
  Scenario scenario = on_body(body, servos);
  scenario.robot.front().bitrate = 0;
  for (int id = 1; id <= 2; ++id) {
    const auto format = protocol::wire_format(servos[0].quirks.dialect, servos[0].profile.series);
    scenario.sends.push_back(
        {.frame = protocol::encode_query(id, protocol::Torque{id == 1 ? 1.5 : -1.0}, format)});
  }
  return scenario;
}

Two angles_after(SimTime step, SimTime time) {
  ScenarioRun run(smooth(step));
  run.advance_to(time);
  return hand_body(run).angles();
}

TEST(Steps, ConvergeWithSecondOrder) {
  const SimTime time = 400 * kMs;
  const Two exact = angles_after(kMs / 8, time);
  std::array<double, 3> error{};
  for (std::size_t n = 0; n < error.size(); ++n) {
    const Two angles = angles_after(kMs * (1 << n), time);
    error[n] = std::max(std::abs(angles[0] - exact[0]), std::abs(angles[1] - exact[1]));
  }
  EXPECT_LT(error[0], 1e-4);
  // Ideally 4, minus higher orders and the reference's own error.
  EXPECT_GT(error[2] / error[1], 3.0) << error[0] << ' ' << error[1] << ' ' << error[2];
  EXPECT_GT(error[1] / error[0], 3.0) << error[0] << ' ' << error[1] << ' ' << error[2];
}

/// Compares all bits.
void expect_same(const ScenarioRun& one, const ScenarioRun& other) {
  EXPECT_EQ(hand_body(one).angles(), hand_body(other).angles());
  EXPECT_EQ(hand_body(one).speeds(), hand_body(other).speeds());
  for (int id = 1; id <= 2; ++id) {
    EXPECT_EQ(one.bus(0).truth(id).theta_m, other.bus(0).truth(id).theta_m);
    EXPECT_EQ(one.bus(0).truth(id).i_q, other.bus(0).truth(id).i_q);
    EXPECT_EQ(one.bus(0).truth(id).omega_out, other.bus(0).truth(id).omega_out);
  }
}

TEST(Steps, DoNotDependOnSlices) {
  ScenarioRun whole(smooth(kMs));
  ScenarioRun sliced(smooth(kMs));
  whole.advance_to(300 * kMs);
  for (int n = 0; n * 137 < 300'000; ++n) sliced.advance_to(n * std::chrono::microseconds(137));
  sliced.advance_to(300 * kMs);
  expect_same(whole, sliced);
}

TEST(Steps, OfACopyEqualTheOriginal) {
  ScenarioRun first(smooth(kMs));
  first.advance_to(std::chrono::microseconds(100'300));
  ScenarioRun copy(first);
  first.advance_to(200 * kMs);
  copy.advance_to(200 * kMs);
  expect_same(first, copy);
}

TEST(Steps, OfAFleetEqualThoseOfASingleRun) {
  ScenarioRun alone(smooth(kMs));
  alone.advance_to(200 * kMs);
  std::vector<ScenarioRun> runs;
  runs.emplace_back(smooth(kMs));
  runs.emplace_back(smooth(2 * kMs));
  ScenarioFleet fleet(std::move(runs));
  fleet.advance_to(std::chrono::microseconds(77'700));
  fleet.advance_to(200 * kMs);
  expect_same(fleet.run(0), alone);
}

/// A step of 20 degrees at both outputs, in opposite directions.
ScenarioRun pulling(const char* motor, double m, SimTime step) {
  const auto body = std::make_shared<HandBody>(2, double_pendulum(m, 0.2), step, Two{0.3, -0.2});
  const ServoConfig first = on_joint(1, motor, *body);
  const ServoConfig second = on_joint(2, motor, *body);
  ScenarioRun run(on_body(body, {first, second}));
  step_output(run, first, 20);
  step_output(run, second, -20);
  return run;
}

/// Stiff gears on a body that is lighter than their rotors, each pulling at the other; compared
/// with an eighth of the step. A light joint may be anywhere in its gear's play. The heavier arm
/// oscillates long on the weakest motor, so only its speed is checked.
TEST(Steps, AreStableWithStiffGearsOnALightBody) {
  for (const char* const motor : {"mg4005", "mg4010", "mg6012-i36", "mg8016"}) {
    const double play = profile(motor).drive.mechanics.backlash_out;
    for (const double m : {0.001, 0.03, 0.3}) {
      ScenarioRun run = pulling(motor, m, kMs);
      ScenarioRun fine = pulling(motor, m, kMs / 8);
      double apart = 0;
      Two fastest{};
      for (int ms = 101; ms < 1500; ++ms) {
        run.advance_to(ms * kMs);
        fine.advance_to(ms * kMs);
        for (std::size_t n = 0; n < 2; ++n) {
          apart =
              std::max(apart, std::abs(hand_body(run).angles()[n] - hand_body(fine).angles()[n]));
          fastest[0] = std::max(fastest[0], std::abs(hand_body(run).speeds()[n]));
          fastest[1] = std::max(fastest[1], std::abs(hand_body(fine).speeds()[n]));
        }
      }
      EXPECT_LT(fastest[0], 1.1 * fastest[1]) << motor << ' ' << m;
      if (m < 0.1) {
        EXPECT_LT(apart, 0.01 * 0.35 + play) << motor << ' ' << m;  // 1 % of the travel
      }
    }
  }
}

// --- a body that is only an inertia equals a load

class LinearBody : public testing::TestWithParam<std::string> {};

TEST_P(LinearBody, MovesLikeALoadOfTheSameInertia) {
  for (const double share : {0.1, 1.0, 10.0, 100.0}) {
    const HandBody anything(1, linear_inertia(1.0), kMs);
    ServoConfig servo = on_joint(1, GetParam(), anything);
    const model::MechanicsParams m = servo.profile.drive.mechanics;
    const double J = share * m.gear_ratio * m.gear_ratio * m.J;
    const auto body = std::make_shared<HandBody>(1, linear_inertia(J), kMs);
    ScenarioRun coupled(on_body(body, {servo}));
    servo.profile.drive.load.J = J;
    ScenarioRun plain(on_body(nullptr, {servo}));
    step_output(coupled, servo, 10);
    step_output(plain, servo, 10);
    double apart = 0;
    double off = 0;
    for (int ms = 101; ms < 2000; ++ms) {
      coupled.advance_to(ms * kMs);
      plain.advance_to(ms * kMs);
      const double output = coupled.bus(0).truth(1).theta_out;
      apart = std::max(apart, std::abs(output - plain.bus(0).truth(1).theta_out));
      off = std::max(off, std::abs(output - hand_body(coupled).angles()[0]));
    }
    // They differ only by rounding, which encoders may turn into counts.
    EXPECT_LT(apart, 1e-4) << share;
    // The gear's play to either side, and its twist under the peak torque: 1/1000 rad.
    EXPECT_LE(off, 0.5 * m.backlash_out + 2e-3) << share;
  }
}

INSTANTIATE_TEST_SUITE_P(Motors, LinearBody, testing::ValuesIn(motor_names()),
                         [](const auto& motor) {
                           std::string name = motor.param;
                           std::ranges::replace(name, '-', '_');
                           return name;
                         });

// --- a battery: its inner resistance lowers each link by the current of all

constexpr double kV = 48.0;
constexpr double kCable_ohm = 0.05;

/// `drives` drives with clamped outputs.
Scenario clamped(int drives, double battery_R_ohm) {
  std::vector<ServoConfig> servos;
  for (int id = 1; id <= drives; ++id) {
    ServoConfig servo;
    servo.id = id;
    servo.profile = profile("mg8016");
    servo.rom = servo.profile.factory;
    servo.profile.drive.supply.v_source = kV;
    servo.profile.drive.supply.R_source = kCable_ohm;
    servo.profile.drive.load.J = 1e3;
    servos.push_back(servo);
  }
  Scenario scenario = on_body(nullptr, servos);
  scenario.robot.front().battery_R_ohm = battery_R_ohm;
  return scenario;
}

void torque(ScenarioRun& run, int id, double iq_A) {
  ServoConfig servo = clamped(1, 0).robot.front().servos.front();
  servo.id = id;
  command(run, servo, (100 + id) * kMs, protocol::Torque{iq_A});
}

/// Returns the power in W of a drive that holds `iq_A`: nearly all copper loss, at any voltage.
double power_W(double iq_A) {
  ScenarioRun run(clamped(1, 0));
  torque(run, 1, iq_A);
  run.advance_to(400 * kMs);
  const double before_J = run.bus(0).state().drawn_J(1);
  run.advance_to(500 * kMs);
  return (run.bus(0).state().drawn_J(1) - before_J) / 0.1;
}

/// Returns the voltage in V at which drive and resistances balance: v·(V − v)/R = P.
double link_V(double R_ohm, double P_W) {
  return 0.5 * (kV + std::sqrt(kV * kV - 4.0 * R_ohm * P_W));
}

TEST(Battery, DropsByTheCurrentOfAllDrives) {
  constexpr double kIq_A = 20.0;
  constexpr double kBattery_ohm = 0.3;
  const double P_W = power_W(kIq_A);
  ScenarioRun run(clamped(4, kBattery_ohm));
  for (int id = 1; id <= 4; ++id) torque(run, id, kIq_A);
  run.advance_to(500 * kMs);
  // Each drive's cable carries its own current, the battery four of them.
  const double expected_V = link_V(kCable_ohm + 4.0 * kBattery_ohm, P_W);
  EXPECT_LT(expected_V, 46.0);
  for (int id = 1; id <= 4; ++id) EXPECT_NEAR(run.bus(0).truth(id).v_bus, expected_V, 0.03);
}

TEST(Battery, LowersTheVoltageOfAnIdleDrive) {
  ScenarioRun run(clamped(2, 1.0));
  run.advance_to(90 * kMs);
  const double idle_V = run.bus(0).truth(2).v_bus;
  const double P_W = power_W(20.0);
  torque(run, 1, 20.0);
  run.advance_to(500 * kMs);
  const double fell_V = idle_V - run.bus(0).truth(2).v_bus;
  const double draws_A = P_W / run.bus(0).truth(1).v_bus;
  // P_W includes the electronics of the first drive.
  EXPECT_NEAR(fell_V, draws_A * 1.0, 0.05 * fell_V);
}

/// Link capacitors behind a large resistance. An estimate from the previous step's current would
/// oscillate for ever from R·C = h/2 on; here R·C is 16 h.
TEST(Battery, VoltageDoesNotOscillate) {
  ScenarioRun run(clamped(12, 3.0));
  torque(run, 1, 5.0);
  run.advance_to(200 * kMs);
  double least = 1e9;
  double most = 0;
  for (int ms = 200; ms < 400; ++ms) {
    run.advance_to(ms * kMs);
    least = std::min(least, run.bus(0).truth(2).v_bus);
    most = std::max(most, run.bus(0).truth(2).v_bus);
  }
  EXPECT_LT(most - least, 0.1);
}

TEST(Battery, DoesNotDependOnSlices) {
  ScenarioRun whole(clamped(3, 0.5));
  ScenarioRun sliced(clamped(3, 0.5));
  for (ScenarioRun* run : {&whole, &sliced}) torque(*run, 1, 15.0);
  whole.advance_to(300 * kMs);
  ScenarioRun copy = sliced;
  for (int step = 1; step <= 600; ++step) {
    sliced.advance_to(std::chrono::microseconds(101'000 + 331 * step));
  }
  for (ScenarioRun* run : {&sliced, &copy}) run->advance_to(300 * kMs);
  for (int id = 1; id <= 3; ++id) {
    EXPECT_EQ(sliced.bus(0).truth(id).v_bus, whole.bus(0).truth(id).v_bus);
    EXPECT_EQ(copy.bus(0).truth(id).v_bus, whole.bus(0).truth(id).v_bus);
  }
}

}  // namespace steps_test
}  // namespace lk::test
