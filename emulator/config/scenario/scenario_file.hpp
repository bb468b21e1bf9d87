#pragma once

/// @file Parsers of scenario files (docs/guides/scenarios.md).

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "emulator/config/config.hpp"
#include "emulator/core/scenario/scenario.hpp"

namespace lk::emulator {

/// Functions that load the other files of a scenario. A ConfigError that they throw passes through;
/// the parser reports other exceptions at the key that names the file.
struct ScenarioFiles {
  /// Loads a robot by name or path.
  std::function<std::vector<BusConfig>(const std::string& name, const Overrides& overrides)> robot;
  /// Loads the text of a log to be played.
  std::function<std::string(const std::string& name)> text;
};

/// Parses a scenario that runs its own robot. `seed` overrides the seed in the file. Throws
/// ConfigError.
Scenario parse_scenario(const std::string& text, const std::string& file,
                        std::optional<std::uint64_t> seed, const ScenarioFiles& files);

/// Parses a scenario for buses that already run. Ignores the keys `seed`, `bitrate` and
/// `generation`. Uses the robot of the scenario only for the names of the buses and for
/// Scenario::mismatches. If no running bus has such a name, matches the buses by order. The result
/// has only the scenario's events. Throws ConfigError.
Scenario parse_live_scenario(const std::string& text, const std::string& file,
                             const std::vector<BusConfig>& running, const ScenarioFiles& files);

}  // namespace lk::emulator
