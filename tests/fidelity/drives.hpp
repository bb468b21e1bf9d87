#pragma once

/// @file Drives as a user gets them with --motor and --generation.

#include <string>
#include <vector>

#include "emulator/config/config_drive.hpp"
#include "tests/support/profile.hpp"

namespace lk::test {

inline constexpr double kLegacyLsb_A = 33.0 / 2048;  // iq of a legacy drive

inline emulator::ServoConfig delivered(const std::string& motor, const std::string& generation,
                                       const emulator::Profile& type) {
  emulator::BusOptions options;
  options.interface = motor;
  options.firmware.generation = generation;
  return emulator::make_servo(1, type, options);
}
inline emulator::ServoConfig delivered(const std::string& motor, const std::string& generation) {
  return delivered(motor, generation, profile(motor));
}

}  // namespace lk::test
