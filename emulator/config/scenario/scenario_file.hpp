#pragma once

/// @file Scenario files (docs/guides/scenarios.md): text to Scenario.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "emulator/config/config.hpp"
#include "emulator/core/scenario/scenario.hpp"

namespace lk::emulator {

/// Loads the other files of a scenario. std::invalid_argument becomes an error of the key that
/// names the file; ConfigError is passed on.
struct ScenarioFiles {
  /// Loads a robot by name or path.
  std::function<std::vector<BusConfig>(const std::string& name, const Overrides& overrides)> robot;
  /// Loads the text of a log to be played.
  std::function<std::string(const std::string& name)> text;
};

/// Parses a scenario that runs its own robot. `seed` overrides the file's. Throws ConfigError.
Scenario parse_scenario(const std::string& text, const std::string& file,
                        std::optional<std::uint64_t> seed, const ScenarioFiles& files);

/// Parses a scenario for running buses: ignores the seed, and the robot except for bus names. If
/// the buses run on other interfaces, they are matched by order. The result has only the scenario's
/// events. Throws ConfigError.
Scenario parse_live_scenario(const std::string& text, const std::string& file,
                             const std::vector<BusConfig>& running, const ScenarioFiles& files);

}  // namespace lk::emulator
