#pragma once

/// @file What a motor file takes over from another (`extends`).

#include <string>
#include <vector>

#include "emulator/config/config_reader.hpp"
#include "emulator/config/motor_file.hpp"

namespace lk::emulator {

/// A motor file with all that it takes over; every value knows the file and line where it stands.
struct MotorDocument {
  toml::table table;
  std::vector<std::string> files;  // its own, that which it extends, …
};
/// Throws ConfigError.
MotorDocument read_motor_document(const MotorFile& motor, const FindMotorFile& find_base);

}  // namespace lk::emulator
