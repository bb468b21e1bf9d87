#pragma once

#include <stdexcept>
#include <string>

namespace lk::emulator {

/// What is wrong with a configuration file and where. `what()` is the line a person reads:
/// `file:line: key: reason`, without the key when the file is not even TOML.
struct ConfigError : std::runtime_error {
  ConfigError(const std::string& file_name, int line_number, const std::string& key_path,
              const std::string& why)
      : std::runtime_error(file_name + ":" + std::to_string(line_number) + ": " +
                           (key_path.empty() ? "" : key_path + ": ") + why),
        file(file_name),
        line(line_number),
        key(key_path),
        reason(why) {}

  std::string file;
  int line;         // from 1
  std::string key;  // dotted path
  std::string reason;
};

}  // namespace lk::emulator
