#pragma once

/// @file Scenario files (docs/scenarios.md): text in, Scenario out.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "emulator/config/config.hpp"
#include "emulator/config/config_reader.hpp"
#include "emulator/core/scenario/scenario.hpp"

namespace lk::emulator {

/// Where a scenario's other files come from. What they throw, std::invalid_argument, becomes a
/// mistake of the key that names them; a ConfigError stays what it is.
struct ScenarioFiles {
  /// The robot of that name or path.
  std::function<std::vector<BusConfig>(const std::string& name, const Overrides& overrides)> robot;
  /// A log to be played: its text.
  std::function<std::string(const std::string& name)> text;
};

/// For a robot of its own. `seed` wins over the file's. Throws ConfigError.
Scenario parse_scenario(const std::string& text, const std::string& file,
                        std::optional<std::uint64_t> seed, const ScenarioFiles& files);
/// As above, from a document that has been parsed; `file` is its name in messages.
Scenario parse_scenario(const toml::table& document, const std::string& file,
                        std::optional<std::uint64_t> seed, const ScenarioFiles& files);

/// For buses that run already: the seed does not count, nor does the robot but for the names of its
/// buses, where they run on other interfaces: they are matched by their order then. The events of
/// the result are the scenario's alone. Throws ConfigError.
Scenario parse_live_scenario(const std::string& text, const std::string& file,
                             const std::vector<BusConfig>& running, const ScenarioFiles& files);

}  // namespace lk::emulator
