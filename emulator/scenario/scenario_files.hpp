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

/// How much of files is read for a scenario, in bytes.
struct FileLimits {
  std::uintmax_t each = kLongestLog;
  std::uintmax_t played = std::numeric_limits<std::uintmax_t>::max();  // of all logs together
  bool no_logs = false;  // which files there are is not to be known
};

/// What scenarios name, looked for from `directory`, the scenario file's: a robot is a path or the
/// name of a shipped one. For one scenario, as what has been read counts.
ScenarioFiles scenario_files(const std::filesystem::path& directory, FileLimits limits = {});

// By a path or the name of a shipped one (meant_file). Throw StartError.
Scenario load_scenario(const std::string& given, std::optional<std::uint64_t> seed);
/// For buses that run already.
Scenario load_live_scenario(const std::string& given, const std::vector<BusConfig>& running,
                            FileLimits limits = {});

}  // namespace lk::emulator
