#pragma once

/// @file Runs of drives on bodies, for tests.

#include <chrono>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "emulator/core/scenario/scenario_run.hpp"
#include "protocol/codec.hpp"
#include "tests/emulator/coupling/hand_bodies.hpp"
#include "tests/support/profile.hpp"

namespace lk::test {

inline constexpr emulator::SimTime kMs = std::chrono::milliseconds(1);

/// Returns a delivered motor as drive `id`, at the body's joint `id` − 1, without sensor noise.
inline emulator::ServoConfig on_joint(int id, const std::string& motor,
                                      const emulator::Mechanism& body) {
  emulator::ServoConfig servo;
  servo.id = id;
  servo.profile = profile(motor);
  servo.profile.drive.encoder.noise = 0;
  servo.profile.drive.current_sensor.noise = 0;
  servo.profile.drive.slow_sensor.v_noise = 0;
  servo.rom = servo.profile.factory;
  const auto joint = static_cast<std::size_t>(id - 1);
  servo.joint = emulator::JointLink{.joint = joint, .start_rad = body.joint(joint).angle_rad};
  return servo;
}

inline emulator::Scenario on_body(std::shared_ptr<const emulator::Mechanism> body,
                                  std::vector<emulator::ServoConfig> servos) {
  emulator::Scenario scenario;
  emulator::BusConfig bus;
  bus.interface = "test";
  bus.servos = std::move(servos);
  bus.body = std::move(body);
  scenario.robot = {bus};
  scenario.duration = std::chrono::seconds(100);
  return scenario;
}

inline const HandBody& hand_body(const emulator::ScenarioRun& run) {
  return dynamic_cast<const HandBody&>(*run.body());
}

}  // namespace lk::test
