#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "emulator/config/config.hpp"
#include "emulator/core/language.hpp"
#include "emulator/files/rom_store.hpp"
#include "emulator/io/control/control_options.hpp"
#include "emulator/io/live/pacer.hpp"
#include "emulator/io/shafts/shaft_body.hpp"

namespace CLI {  // NOLINT(readability-identifier-naming): the library's
class App;
}

namespace lk::emulator {

struct ConfigTexts;

/// The parsed command line.
struct CommandLine {
  Overrides overrides;
  std::optional<std::filesystem::path> config_file;
  bool create_bus = false;
  bool real_bus = false;  // interfaces need not be virtual
  bool check = false;     // print what would run, and start nothing
  RomOptions rom;
  ClockMode clock;
  ControlOptions control;
  std::optional<ShaftOptions> shafts;
  std::optional<std::filesystem::path> scenario;
  std::optional<std::filesystem::path> junit;   // of the scenario
  std::optional<std::filesystem::path> record;  // directory that gets a recording
  bool strict = false;                          // advice is a failure
  bool end_with_input = false;                  // standard input
  Language language = Language::kEnglish;       // of advice
  std::string log_level = "info";
};

/// Parses the command line. Empty if nothing remains to do (`--help`, `--version`, printed on
/// standard output). Throws StartError.
std::optional<CommandLine> parse_command_line(int argc, const char* const* argv);

/// Returns the options of a run, for completions; other commands have theirs in commands().
std::shared_ptr<CLI::App> program_app();

inline constexpr const char* kLogLevels[] = {"trace", "debug", "info", "warn", "error", "off"};

/// Returns the buses to run, from configuration file, profiles and command line. Stores the files
/// that were read in `texts`, unless null. Throws StartError.
std::vector<BusConfig> load_config(const CommandLine& command_line, ConfigTexts* texts = nullptr);

}  // namespace lk::emulator
