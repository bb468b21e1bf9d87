// Compares two complete drives on MuJoCo's double pendulum with a single system of equations.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <regex>
#include <string>
#include <vector>

#include "emulator/core/servo/registers.hpp"
#include "emulator/core/wire_timing.hpp"
#include "tests/emulator/body/body_support.hpp"
#include "tests/emulator/body/double_reference.hpp"
#include "tests/emulator/coupling/coupling_support.hpp"
#include "tests/model/reference_firmware.hpp"
#include "tests/support/bus_config.hpp"

namespace lk::test {
namespace double_pendulum_test {

using emulator::Scenario;
using emulator::ScenarioRun;
using emulator::ServoConfig;

ServoConfig smooth_drive(int id) {
  ServoConfig servo = servo_config(id);
  model::DriveParams& d = servo.profile.drive;
  d.mechanics.gear_ratio = 6;
  d.mechanics.J = 2e-5;
  d.mechanics.J_out = 1e-4;
  d.mechanics.B = 1e-4;
  d.motor.alpha_cu = d.motor.alpha_pm = 0;
  d.encoder.bits = 18;
  servo.joint = emulator::JointLink{.joint = static_cast<std::size_t>(id - 1)};
  return servo;
}

protocol::Frame query(const protocol::Position5& step, int id) {
  const ServoConfig servo = smooth_drive(id);
  return protocol::encode_query(id, step,
                                protocol::wire_format(servo.quirks.dialect, servo.profile.series));
}

Scenario on_pendulum() {
  Scenario scenario = on_body(body_of(kDoublePendulum), {smooth_drive(1), smooth_drive(2)});
  scenario.robot.front().bitrate = 0;
  return scenario;
}

/// Requirement: 0.1 % of the travel.
TEST(DoublePendulum, IsWhereOneSystemOfEquationsHasIt) {
  ScenarioRun run(on_pendulum());
  const ServoConfig servo = smooth_drive(1);
  const model::DriveParams& d = servo.profile.drive;
  const auto settings = emulator::control_settings(
      servo.rom, protocol::wire_format(servo.quirks.dialect, servo.profile.series));
  std::array<model::test::Firmware, 2> firmware{model::test::Firmware(d, settings),
                                                model::test::Firmware(d, settings)};
  DoubleReference reference(d, double_pendulum(0.3, 0.25, 1e-5));
  const double T = 1 / d.inverter.f_pwm;
  const auto f_Hz = static_cast<std::int64_t>(d.inverter.f_pwm);
  double travel = 0;
  double worst = 0;
  std::int64_t tick = 0;
  for (const std::int32_t turn_cdeg : {30'000, -42'000, 18'000}) {  // of the rotors
    const auto now = emulator::time_of_tick(tick, f_Hz);
    for (const int id : {1, 2}) {
      run.receive(0, {now, query({id == 1 ? turn_cdeg : -turn_cdeg / 2}, id)});
      run.advance_to(now);
      firmware[static_cast<std::size_t>(id - 1)].command(run.bus(0).state().setpoint(id));
    }
    for (const std::int64_t end = tick + f_Hz / 4; tick < end; ++tick) {
      const DoubleReference::State y = reference.state();
      std::array<std::array<double, 3>, 2> duty{};
      for (std::size_t n = 0; n < 2; ++n) {
        const double N = d.mechanics.gear_ratio;
        duty[n] = firmware[n].step(
            {y[3 * n], y[3 * n + 1], N * y[6 + n], N * y[8 + n], y[3 * n + 2], 25, 25, 25});
      }
      reference.advance(duty, T);
      if ((tick + 1) % (f_Hz / 1000) != 0) continue;
      run.advance_to(emulator::time_of_tick(tick + 1, f_Hz));
      for (std::size_t n = 0; n < 2; ++n) {
        const double angle = run.body()->joint(n).angle_rad;
        travel = std::max(travel, std::abs(angle));
        worst = std::max(worst, std::abs(angle - reference.state()[6 + n]));
      }
    }
  }
  EXPECT_GT(travel, 0.8);
  EXPECT_LT(worst, 1e-3 * travel);
}

/// Errors of both joints after 0.4 s under constant torques in steps of 1, 2 and 4 ms, relative to
/// steps of 1/8 ms. Without quantisation: PWM, encoder and current sensor are as fine as possible.
std::array<double, 3> errors_with(const std::string& integrator) {
  const std::string model = std::regex_replace(
      std::string(kDoublePendulum), std::regex(R"(timestep="0.001" integrator="RK4")"),
      R"(timestep="0.004" integrator=")" + integrator + '"');
  const auto angles_after = [&](emulator::SimTime step) {
    std::vector<ServoConfig> drives = {smooth_drive(1), smooth_drive(2)};
    for (ServoConfig& servo : drives) {
      servo.profile.drive.inverter.timer_counts = 1e9;
      servo.profile.drive.current_sensor.bits = 26;
    }
    Scenario scenario = on_body(body_of(model, step), drives);
    scenario.robot.front().bitrate = 0;
    const auto format = protocol::wire_format(drives[0].quirks.dialect, drives[0].profile.series);
    for (const int id : {1, 2}) {
      scenario.sends.push_back(
          {.frame = protocol::encode_query(id, protocol::Torque{id == 1 ? 1.5 : -1.0}, format)});
    }
    ScenarioRun run(scenario);
    run.advance_to(400 * kMs);
    return Two{run.body()->joint(0).angle_rad, run.body()->joint(1).angle_rad};
  };
  const Two exact = angles_after(kMs / 8);
  std::array<double, 3> errors{};
  for (std::size_t n = 0; n < errors.size(); ++n) {
    const Two angles = angles_after(kMs * (1 << n));
    errors[n] = std::max(std::abs(angles[0] - exact[0]), std::abs(angles[1] - exact[1]));
  }
  return errors;
}

/// Doubling the step multiplies the error by four, minus higher orders and the reference's own
/// error.
TEST(DoublePendulum, IsOfSecondOrderWithRungeKutta) {
  const auto error = errors_with("RK4");
  EXPECT_GT(error[1] / error[0], 3.0) << error[0] << ' ' << error[1] << ' ' << error[2];
  EXPECT_GT(error[2] / error[1], 3.0) << error[0] << ' ' << error[1] << ' ' << error[2];
}

/// Doubling the step doubles the error.
TEST(DoublePendulum, IsOfFirstOrderWithEuler) {
  const auto error = errors_with("Euler");
  EXPECT_NEAR(error[1] / error[0], 2.2, 0.4) << error[0] << ' ' << error[1] << ' ' << error[2];
  EXPECT_NEAR(error[2] / error[1], 2.2, 0.4) << error[0] << ' ' << error[1] << ' ' << error[2];
}

TEST(DoublePendulum, IsTheSameThreeTimesAndInSlices) {
  const auto end = [](std::chrono::microseconds slice) {
    ScenarioRun run(on_pendulum());
    run.receive(0, {kMs, query({30'000}, 1)});
    for (auto t = slice; t < 300 * kMs; t += slice) run.advance_to(t);
    run.advance_to(300 * kMs);
    return std::array{run.body()->joint(0).angle_rad, run.body()->joint(1).angle_rad,
                      run.bus(0).truth(1).i_q, run.bus(0).truth(2).theta_m};
  };
  const auto first = end(std::chrono::microseconds(300'000));
  EXPECT_EQ(end(std::chrono::microseconds(300'000)), first);
  EXPECT_EQ(end(std::chrono::microseconds(300'000)), first);
  EXPECT_EQ(end(std::chrono::microseconds(713)), first);
}

}  // namespace double_pendulum_test
}  // namespace lk::test
