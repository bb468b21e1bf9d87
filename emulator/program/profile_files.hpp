#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "emulator/core/bus_config.hpp"

namespace lk::emulator {

/// Where the shipped files are: beside the program, as installed or as built.
std::filesystem::path config_directory();

/// Names of the shipped motor profiles, sorted.
std::vector<std::string> known_motors();

/// The file of a shipped profile. Throws UnknownMotor.
std::filesystem::path motor_file(const std::string& name);

/// Reads a shipped profile. Throws UnknownMotor, ConfigError.
Profile load_profile(const std::string& name);

/// The whole of `file`. Throws std::invalid_argument that says what is wrong with it.
std::string read_file(const std::filesystem::path& file);
/// The same for a running program: nothing that never ends, waits for somebody, or is longer than
/// `longest` bytes.
std::string read_regular_file(const std::filesystem::path& file, std::uintmax_t longest);

}  // namespace lk::emulator
