#pragma once

/// @file A drive on a body, step by step, for tests.

#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <initializer_list>
#include <memory>
#include <span>
#include <string_view>
#include <utility>

#include "emulator/core/coupling/coupling.hpp"
#include "tests/emulator/coupling/coupling_support.hpp"
#include "tests/support/bus_config.hpp"
#include "tests/support/faults.hpp"

namespace lk::test {

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
  void say(const protocol::Command& command) {
    const auto& servo = config_.servos.front();
    bus_.receive(
        {bus_.time(),
         protocol::encode_query(
             1, command, protocol::wire_format(servo.quirks.dialect, servo.profile.series))});
  }
  void torque_current(double iq_A) { say(protocol::Torque{iq_A}); }
  void put(double angle_rad) {
    emulator::Pose pose;
    pose.joints = {{0, angle_rad}};
    bus_.apply({emulator::kWholeBus, emulator::BodyAct{pose}});
  }
  void fault(std::string_view word, std::initializer_list<emulator::FaultValue> values = {}) {
    ASSERT_TRUE(bus_.apply({emulator::kWholeBus, emulator::SetFault{fault_of(word, values, {1})}}));
  }
  void heal() { bus_.apply({emulator::kWholeBus, emulator::ClearFault{"all"}}); }
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
