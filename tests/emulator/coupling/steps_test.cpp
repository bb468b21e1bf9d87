// The steps of a body: order, slices, copies.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
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

TEST(Steps, AreOfSecondOrder) {
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

TEST(Steps, OfACopyAreItsOwn) {
  ScenarioRun first(smooth(kMs));
  first.advance_to(std::chrono::microseconds(100'300));
  ScenarioRun copy(first);
  first.advance_to(200 * kMs);
  copy.advance_to(200 * kMs);
  expect_same(first, copy);
}

TEST(Steps, InAFleetAreThoseAlone) {
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
  ScenarioRun run(on_body(body, {first, on_joint(2, motor, *body)}));
  const double N = first.profile.drive.mechanics.gear_ratio;
  const auto increment = static_cast<std::int32_t>(std::lround(2000 * N));
  const auto format = protocol::wire_format(first.quirks.dialect, first.profile.series);
  for (const int id : {1, 2}) {
    const protocol::Position5 turn{id == 1 ? increment : -increment};
    run.receive(0, {100 * kMs, protocol::encode_query(id, turn, format)});
  }
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

}  // namespace steps_test
}  // namespace lk::test
