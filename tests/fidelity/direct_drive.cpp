#include "tests/fidelity/direct_drive.hpp"

#include <chrono>
#include <cmath>

#include "emulator/config/stator.hpp"
#include "tests/fidelity/drives.hpp"

namespace lk::test {

emulator::ServoConfig logged_drive() {
  static const emulator::Profile kType = [] {
    emulator::Profile type = profile("mf7015-23t");
    model::MotorParams& motor = type.drive.motor;
    motor.psi_f *= motor.pole_pairs / 21.0;
    motor.pole_pairs = 21;
    emulator::set_texture({.slots = 36, .diameter = 0.070, .height = 0.015}, type.drive);
    return type;
  }();
  return delivered("mf7015-23t", "legacy", kType);
}

Host logged_specimen(std::uint64_t seed, double J_load_kg_m2) {
  emulator::ServoConfig servo = logged_drive();
  servo.profile.drive.load.J = J_load_kg_m2;
  emulator::BusConfig config = bus_config({});
  config.seed = seed;
  config.servos.push_back(servo);
  Host host(config);
  host.wait(std::chrono::milliseconds(200));
  return host;
}

std::vector<double> torque_shares(const std::vector<double>& after_ms) {
  const std::vector<double> steps_lsb{50, 100, 150};
  constexpr std::uint64_t kPositions = 8;
  std::vector<double> shares(after_ms.size());
  for (std::uint64_t seed = 1; seed <= kPositions; ++seed) {
    for (const double step_lsb : steps_lsb) {
      Host host = logged_specimen(seed);
      double waited_ms = 0;
      host.get<protocol::State2>(protocol::Torque{.iq_A = step_lsb * kLegacyLsb_A});
      for (std::size_t n = 0; n < after_ms.size(); ++n) {
        host.wait(std::chrono::microseconds(std::lround(1000 * (after_ms[n] - waited_ms))));
        waited_ms = after_ms[n];
        shares[n] += host.state_2().iq_A / kLegacyLsb_A / step_lsb /
                     static_cast<double>(kPositions * steps_lsb.size());
      }
    }
  }
  return shares;
}

}  // namespace lk::test
