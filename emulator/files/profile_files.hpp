#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "emulator/config/config.hpp"
#include "emulator/config/motor_file.hpp"

namespace lk::emulator {

/// A file compiled into the program (cmake/EmbedFiles.cmake).
struct EmbeddedFile {
  std::string_view path;  // "/glance.js"
  std::string_view type;  // content type
  std::string_view etag;  // changes with the content
  std::string_view body;
};

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

/// Makes a body from a model file. Throws std::invalid_argument with file and reason.
using BodyMaker = std::shared_ptr<const Mechanism> (*)(const std::filesystem::path& file,
                                                       SimTime step);

/// Sets the maker of bodies for robots; null if the program does not support bodies.
void use_bodies(BodyMaker maker);

/// The file of the model that a robot file names. Throws std::invalid_argument: there is none.
std::filesystem::path body_file(const std::string& robot_file, const std::string& model);

/// For robot files: a model is a path from there, or the name of a shipped one.
LoadBody body_loader();

}  // namespace lk::emulator
