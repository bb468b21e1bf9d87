#pragma once

/// @file Inheritance of motor files (`extends`).

#include <string>
#include <vector>

#include "emulator/config/config_reader.hpp"
#include "emulator/config/motor_file.hpp"

namespace lk::emulator {

/// A motor file with all inherited values; each value keeps its own file and line.
struct MotorDocument {
  toml::table table;
  std::vector<std::string> files;  // its own, then the one that it extends, …
};
/// Throws ConfigError.
MotorDocument read_motor_document(const MotorFile& motor, const FindMotorFile& find_base);

}  // namespace lk::emulator
