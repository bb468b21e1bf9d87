#pragma once

/// @file The shipped motors and robots, read once.

#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <string>

#include "emulator/config/config.hpp"
#include "emulator/config/profile.hpp"

namespace lk::fuzz {

/// Returns the contents of a file below configs/; empty if it does not exist.
inline const std::string& shipped_text(const std::string& file) {
  static std::map<std::string, std::string> known;
  const auto found = known.find(file);
  if (found != known.end()) return found->second;
  std::ifstream stream(std::filesystem::path(LKEMU_SOURCE_DIR) / "configs" / file,
                       std::ios::binary);
  return known[file] = std::string(std::istreambuf_iterator<char>(stream), {});
}

/// Returns whether the name is a plain file name; a harness must not follow paths.
inline bool plain_name(const std::string& name) {
  return !name.empty() && name.size() < 40 &&
         name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-_") == std::string::npos;
}

inline emulator::MotorFile shipped_motor(const std::string& name) {
  const std::string file = "motors/" + name + ".toml";
  if (!plain_name(name) || shipped_text(file).empty()) throw emulator::UnknownMotor("no " + name);
  return {name, file, shipped_text(file)};
}

inline emulator::Profile shipped_profile(const std::string& name) {
  static std::map<std::string, emulator::Profile> known;
  const auto found = known.find(name);
  return found != known.end()
             ? found->second
             : known.emplace(name, parse_profile(shipped_motor(name), shipped_motor)).first->second;
}

/// Removes and returns the first part of a text, up to a line "---".
inline std::string take_part(std::string& rest) {
  const std::size_t end = rest.find("\n---\n");
  std::string part = rest.substr(0, end);
  rest = end == std::string::npos ? std::string() : rest.substr(end + 5);
  return part;
}

}  // namespace lk::fuzz
