#pragma once

/// @file The motor files of the source tree, for tests with a real motor.

#include <fstream>
#include <sstream>
#include <string>

#include "emulator/config/profile.hpp"

namespace lk::test {

/// The profile configs/motors/<name>.toml.
inline emulator::Profile profile(const std::string& name) {
  const std::string file = std::string(LKEMU_SOURCE_DIR) + "/configs/motors/" + name + ".toml";
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return emulator::parse_profile(text.str(), file, name);
}

}  // namespace lk::test
