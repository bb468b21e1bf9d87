#pragma once

/// @file The motor files of the source tree, for tests with a real motor.

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "emulator/config/profile.hpp"

namespace lk::test {

/// Returns the names of all files in configs/motors, sorted.
inline std::vector<std::string> motor_names() {
  std::vector<std::string> names;
  for (const auto& file : std::filesystem::directory_iterator(LKEMU_SOURCE_DIR "/configs/motors")) {
    names.push_back(file.path().stem());
  }
  std::ranges::sort(names);
  return names;
}

/// Reads the file configs/motors/<name>.toml.
inline emulator::MotorFile motor_file(const std::string& name) {
  const std::string file = std::string(LKEMU_SOURCE_DIR) + "/configs/motors/" + name + ".toml";
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return {name, file, text.str()};
}

inline emulator::Profile profile(const std::string& name) {
  return emulator::parse_profile(motor_file(name), motor_file);
}

}  // namespace lk::test
