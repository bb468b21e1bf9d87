#pragma once

/// @file Drives on bodies, for tests: runs of scenarios, and a single drive step by step.

#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <initializer_list>
#include <memory>
#include <numbers>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "emulator/core/coupling/coupling.hpp"
#include "emulator/core/scenario/scenario_run.hpp"
#include "protocol/codec.hpp"
#include "tests/emulator/coupling/hand_bodies.hpp"
#include "tests/support/bus_config.hpp"
#include "tests/support/faults.hpp"
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

/// Sends a command to a drive of the first bus.
inline void command(emulator::ScenarioRun& run, const emulator::ServoConfig& servo,
                    emulator::SimTime at, const protocol::Command& command) {
  const auto format = protocol::wire_format(servo.quirks.dialect, servo.profile.series);
  run.receive(0, {at, protocol::encode_query(servo.id, command, format)});
}

/// A step of `deg` at the output.
inline void step_output(emulator::ScenarioRun& run, const emulator::ServoConfig& servo,
                        double deg) {
  const double turn_cdeg = 100 * deg * servo.profile.drive.mechanics.gear_ratio;
  command(run, servo, 100 * kMs,
          protocol::Position5{static_cast<std::int32_t>(std::lround(turn_cdeg))});
}

/// A bus of one frictionless drive on a body, step by step.
class OnBody {
 public:
  OnBody(std::shared_ptr<const emulator::Mechanism> body, emulator::ServoConfig servo)
      : config_(make(std::move(body), std::move(servo))),
        bus_(config_),
        buses_{&bus_},
        coupling_(std::span(&config_, 1), buses_) {}

  void advance(double seconds) {
    const auto until =
        bus_.time() + std::chrono::round<emulator::SimTime>(std::chrono::duration<double>(seconds));
    while (coupling_.next_due() <= until) {
      bus_.reach(coupling_.next_due());
      coupling_.exchange(buses_);
    }
    bus_.advance_to(until);
  }
  void send(const protocol::Command& command) {
    const auto& servo = config_.servos.front();
    bus_.receive(
        {bus_.time(),
         protocol::encode_query(
             1, command, protocol::wire_format(servo.quirks.dialect, servo.profile.series))});
  }
  void torque_current(double iq_A) { send(protocol::Torque{iq_A}); }
  void move_body(double angle_rad) {
    emulator::Pose pose;
    pose.joints = {{0, angle_rad}};
    bus_.apply({emulator::kWholeBus, emulator::BodyAct{pose}});
  }
  void fault(std::string_view word, std::initializer_list<emulator::FaultValue> values = {}) {
    ASSERT_TRUE(bus_.apply({emulator::kWholeBus, emulator::SetFault{fault_of(word, values, {1})}}));
  }
  void clear_faults() { bus_.apply({emulator::kWholeBus, emulator::ClearFault{"all"}}); }
  model::Truth truth() const { return bus_.truth(1); }
  emulator::DriveView view() const { return bus_.view(1); }
  const HandBody& body() const { return dynamic_cast<const HandBody&>(*coupling_.body()); }
  model::EnergyLedger energy() {
    const auto place = bus_.state().motors.location_of(config_.servos.front(), config_);
    return bus_.state().motors.bank(place).energy(bus_.state().motors.index(place));
  }

 private:
  static emulator::BusConfig make(std::shared_ptr<const emulator::Mechanism> body,
                                  emulator::ServoConfig servo) {
    emulator::BusConfig config = bus_config({});
    servo.joint = emulator::JointLink{.start_rad = body->joint(0).angle_rad};
    config.servos = {std::move(servo)};
    config.body = std::move(body);
    return config;
  }
  emulator::BusConfig config_;
  emulator::Bus bus_;
  std::array<emulator::Bus*, 1> buses_;
  emulator::Coupling coupling_;
};

inline emulator::ServoConfig geared_drive(double ratio) {
  emulator::ServoConfig servo = servo_config(1);
  servo.profile.drive.mechanics.gear_ratio = ratio;
  servo.profile.drive.mechanics.J_out = 1e-4;
  return servo;
}

}  // namespace lk::test
