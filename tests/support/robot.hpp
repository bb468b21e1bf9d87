#pragma once

/// @file The delivered robots, for tests.

#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "emulator/config/config.hpp"
#include "tests/support/profile.hpp"

namespace lk::test {

inline std::string robot_file(const std::string& name) {
  return std::string(LKEMU_SOURCE_DIR) + "/configs/buses/" + name + ".toml";
}

inline std::string text_of_robot(const std::string& name) {
  std::ostringstream text;
  text << std::ifstream(robot_file(name)).rdbuf();
  return text.str();
}

/// Reads the buses of configs/buses/`name`.toml.
inline std::vector<emulator::BusConfig> robot(const std::string& name) {
  return emulator::parse_config(text_of_robot(name), robot_file(name), {}, profile);
}

}  // namespace lk::test
