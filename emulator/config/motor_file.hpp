#pragma once

/// @file Motor files by name or by path; what one takes over from another is in motor_document.hpp.

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace lk::emulator {

/// The text of a motor file.
struct MotorFile {
  std::string name;  // what listings and replies call the motor: "mf7015", "my.toml"
  std::string file;  // its path, for messages, and for the paths in it
  std::string text;
};

/// Gives the file of a motor by its name or path; throws UnknownMotor.
using FindMotorFile = std::function<MotorFile(const std::string& motor)>;

/// Motor files that may extend each other, one after the other.
inline constexpr std::size_t kMostMotorFiles = 8;

/// Whether something is given by its file, "./my.toml", "motors/my", and not by its name.
bool is_path(const std::string& given);

/// The motor that `file` means by `motor`: a path in it is relative to its directory.
std::string motor_of(const std::string& file, const std::string& motor);

/// What a motor is sold as: the `model` and the `aliases` of its file. Throws ConfigError.
std::vector<std::string> motor_labels(const std::string& text, const std::string& file);

}  // namespace lk::emulator
