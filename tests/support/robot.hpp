#pragma once

/// @file The delivered robots, for tests.

#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "emulator/config/config.hpp"
#include "tests/support/profile.hpp"

namespace lk::test {

/// The buses of configs/buses/`name`.toml.
inline std::vector<emulator::BusConfig> robot(const std::string& name) {
  const std::string file = std::string(LKEMU_SOURCE_DIR) + "/configs/buses/" + name + ".toml";
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return emulator::parse_config(text.str(), file, {}, profile);
}

}  // namespace lk::test
