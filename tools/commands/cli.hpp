#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "emulator/io/program/daemon.hpp"

namespace CLI {  // NOLINT(readability-identifier-naming): the library's
class App;
}

namespace lk::emulator {

/// The parsed command line of `lk-emu` without a command: run drives.
struct CommandLine {
  RunOptions run;
  std::optional<std::filesystem::path> config_file;
  std::optional<std::filesystem::path> scenario;
  bool check = false;  // true: print the configuration but start nothing
  std::string log_level = "info";
};

/// Parses the command line. Empty if nothing remains to do: `--help` or `--version` is printed on
/// standard output. Throws StartError.
std::optional<CommandLine> parse_command_line(int argc, const char* const* argv);

/// Returns the options of `lk-emu` without a command, for completions. commands() has the others.
std::shared_ptr<CLI::App> program_app();

inline constexpr const char* kLogLevels[] = {"trace", "debug", "info", "warn", "error", "off"};

/// Returns the buses to run, from configuration file, profiles and command line. Stores the texts
/// of the files in `command_line.run.texts`. Throws StartError.
std::vector<BusConfig> load_config(CommandLine& command_line);

}  // namespace lk::emulator
