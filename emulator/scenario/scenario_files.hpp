#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "emulator/config/scenario/config_scenario.hpp"
#include "emulator/files/regular_file.hpp"

namespace lk::emulator {

/// Limits for files of a scenario, in bytes.
struct FileLimits {
  std::uintmax_t each = kLongestLog;
  std::uintmax_t played = std::numeric_limits<std::uintmax_t>::max();  // of all logs together
  bool no_logs = false;  // do not reveal which files exist
};

/// Loads the files of one scenario, relative to `directory`, that of the scenario file. A robot is
/// a path or the name of a shipped one. Counts the bytes read.
ScenarioFiles scenario_files(const std::filesystem::path& directory, FileLimits limits = {});

// `given` is a path or a shipped name (meant_file). Throw StartError.
Scenario load_scenario(const std::string& given, std::optional<std::uint64_t> seed);
/// For running buses.
Scenario load_live_scenario(const std::string& given, const std::vector<BusConfig>& running,
                            FileLimits limits = {});

}  // namespace lk::emulator
