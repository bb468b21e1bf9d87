#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "emulator/config/config.hpp"
#include "emulator/config/motor_file.hpp"

namespace lk::emulator {

/// Where the shipped files are: beside the program, as installed or as built.
std::filesystem::path config_directory();

/// What is shipped besides motors, and where: `folder` of the shipped files.
struct Shelf {
  const char* folder;
  const char* what;  // is there
};
inline constexpr Shelf kRobots{"buses", "robot"};
inline constexpr Shelf kScenarios{"scenarios", "scenario"};
inline constexpr Shelf kCampaigns{"campaigns", "campaign"};

/// Names of what is there, sorted.
std::vector<std::string> known_files(const Shelf& shelf);
/// The shipped file of that name. Throws std::invalid_argument that says which there are.
std::filesystem::path shipped_file(const Shelf& shelf, const std::string& name);
/// What a person means on the command line: a path, or a bare name, which is a file of the working
/// directory or a shipped one. Throws std::invalid_argument.
std::filesystem::path meant_file(const Shelf& shelf, const std::string& given);

/// Names of the shipped motor profiles, sorted.
std::vector<std::string> known_motors();

/// All that the shipped profiles can be called: their names, then what they are sold as.
std::vector<std::string> motor_words();

/// Finds a motor by its name or label, in capital or small letters, or by the path of its file.
/// Throws UnknownMotor.
MotorFile find_motor_file(const std::string& motor);

/// The motor files that were read, by what they were asked for as.
using MotorFiles = std::map<std::string, MotorFile>;
/// Reads each motor file once, and puts it into `read`, which has to live as long.
FindProfile profile_finder(MotorFiles& read);

/// Reads one profile. Throws UnknownMotor, ConfigError.
Profile load_profile(const std::string& motor);

}  // namespace lk::emulator
