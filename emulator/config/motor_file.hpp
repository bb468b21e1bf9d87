#pragma once

/// @file Motor files by name or path; motor_document.hpp has their inheritance.

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace lk::emulator {

/// The text of a motor file.
struct MotorFile {
  std::string name;  // name in listings and replies: "mf7015", "my.toml"
  std::string file;  // its path, for messages and for relative paths in it
  std::string text;
};

/// Returns a motor file by name or path. Throws UnknownMotor.
using FindMotorFile = std::function<MotorFile(const std::string& motor)>;

/// Longest chain of motor files that extend each other.
inline constexpr std::size_t kMostMotorFiles = 8;

/// Returns true for a path such as "./my.toml" or "motors/my", false for a name.
bool is_path(const std::string& given);

/// Resolves `motor` as written in `file`: a path is relative to the directory of `file`.
std::string motor_of(const std::string& file, const std::string& motor);

/// Returns the trade names of a motor: `model` and `aliases`. Throws ConfigError.
std::vector<std::string> motor_labels(const std::string& text, const std::string& file);

}  // namespace lk::emulator
