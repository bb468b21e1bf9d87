#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "emulator/config/config.hpp"
#include "emulator/config/motor_file.hpp"

namespace lk::emulator {

/// Returns the directory of shipped files, relative to the program, installed or built.
std::filesystem::path config_directory();

/// A kind of shipped file besides motors, and its `folder`.
struct Shelf {
  const char* folder;
  const char* what;  // word for messages
};
inline constexpr Shelf kRobots{"buses", "robot"};
inline constexpr Shelf kScenarios{"scenarios", "scenario"};
inline constexpr Shelf kCampaigns{"campaigns", "campaign"};

/// Returns the names of these files, sorted.
std::vector<std::string> known_files(const Shelf& shelf);
/// Returns the shipped file of that name. Throws std::invalid_argument with the known names.
std::filesystem::path shipped_file(const Shelf& shelf, const std::string& name);
/// Finds the file for a command-line argument: a path, or a plain name of a file in the working
/// directory or of a shipped one. Throws std::invalid_argument.
std::filesystem::path meant_file(const Shelf& shelf, const std::string& given);

/// Returns the names of shipped motor profiles, sorted.
std::vector<std::string> known_motors();

/// Returns all words for shipped motors: names, then trade names.
std::vector<std::string> motor_words();

/// Finds a motor by name or label, ignoring case, or by path. Throws UnknownMotor.
MotorFile find_motor_file(const std::string& motor);

/// Motor files that were read, by requested name.
using MotorFiles = std::map<std::string, MotorFile>;
/// Reads each motor file once and adds it to `read`, which must outlive the finder.
FindProfile profile_finder(MotorFiles& read);

/// Reads one profile. Throws UnknownMotor, ConfigError.
Profile load_profile(const std::string& motor);

}  // namespace lk::emulator
