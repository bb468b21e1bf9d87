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
  std::string_view type;  // content type for HTTP
  std::string_view etag;  // changes with the content
  std::string_view body;
};

/// Returns the directory of the shipped files. It is found relative to the program, both installed
/// and in the build tree.
std::filesystem::path config_directory();

/// A kind of shipped files other than motors. `folder` is in config_directory().
struct Shelf {
  const char* folder;
  const char* what;  // word for messages
};
inline constexpr Shelf kRobots{"buses", "robot"};
inline constexpr Shelf kScenarios{"scenarios", "scenario"};
inline constexpr Shelf kCampaigns{"campaigns", "campaign"};

/// Returns the names of the shipped files of this kind, sorted.
std::vector<std::string> known_files(const Shelf& shelf);
/// Returns the path of the shipped file `name`. Throws std::invalid_argument with the known names.
std::filesystem::path shipped_file(const Shelf& shelf, const std::string& name);
/// Finds the file for a command-line argument: a path, or a plain name of a file in the working
/// directory or of a shipped one. Throws std::invalid_argument.
std::filesystem::path meant_file(const Shelf& shelf, const std::string& given);

/// Returns the names of shipped motor profiles, sorted.
std::vector<std::string> known_motors();

/// Returns all words that find a shipped motor: names, then trade names.
std::vector<std::string> motor_words();

/// Reads the file of a motor, found by name or label, ignoring case, or by path. Throws
/// UnknownMotor.
MotorFile find_motor_file(const std::string& motor);

/// Motor files that were read, by requested name.
using MotorFiles = std::map<std::string, MotorFile>;
/// Returns a function that reads each motor file once and adds it to `read`, which must outlive the
/// function.
FindProfile profile_finder(MotorFiles& read);

/// Reads one profile. Throws UnknownMotor, ConfigError.
Profile load_profile(const std::string& motor);

/// Makes a body from a model file. Throws std::invalid_argument with file and reason.
using BodyMaker = std::shared_ptr<const Mechanism> (*)(const std::filesystem::path& file,
                                                       SimTime step);

/// Sets the function that `body_loader` uses; null if the program does not support bodies.
void use_bodies(BodyMaker maker);

/// Returns the file of the body `model` that `robot_file` names. Throws std::invalid_argument if
/// there is none.
std::filesystem::path body_file(const std::string& robot_file, const std::string& model);

/// Returns a function that loads the body of a robot file; empty if the program does not support
/// bodies. A model is a path relative to the robot file, or the name of a shipped model.
LoadBody body_loader();

}  // namespace lk::emulator
