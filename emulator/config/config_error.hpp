#pragma once

#include <stdexcept>
#include <string>

#include "emulator/core/text.hpp"

namespace lk::emulator {

/// An error in a configuration file. `what()` is the line for the user: `file:line: key: reason`.
/// The key is left out if the file is not valid TOML; the line is left out if the source has no
/// lines, e.g. JSON.
struct ConfigError : std::runtime_error {
  ConfigError(const std::string& file_name, int line_number, const std::string& key_path,
              const std::string& why)
      : std::runtime_error(sanitized_line(file_name + place(line_number) + ": " +
                                          (key_path.empty() ? "" : key_path + ": ") + why)),
        file(file_name),
        line(line_number),
        key(key_path),
        reason(sanitized_line(why)) {}

  std::string file;
  int line;         // from 1; 0: the source has no lines
  std::string key;  // dotted path
  std::string reason;

 private:
  static std::string place(int line_number) {
    std::string text;
    if (line_number > 0) text.append(":").append(std::to_string(line_number));
    return text;
  }
};

}  // namespace lk::emulator
