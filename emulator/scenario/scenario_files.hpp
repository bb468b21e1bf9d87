#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "emulator/config/config_scenario.hpp"

namespace lk::emulator {

/// What scenarios name, looked for from `directory`, the scenario file's: a robot is a path or the
/// name of a shipped one. None may be longer than `longest` bytes.
inline constexpr std::uintmax_t kLongestOfAll = 67'108'864;
ScenarioFiles scenario_files(const std::filesystem::path& directory,
                             std::uintmax_t longest = kLongestOfAll);

// Throw StartError.
Scenario load_scenario(const std::filesystem::path& file, std::optional<std::uint64_t> seed);
/// For buses that run already.
Scenario load_live_scenario(const std::filesystem::path& file,
                            const std::vector<BusConfig>& running,
                            std::uintmax_t longest = kLongestOfAll);

}  // namespace lk::emulator
