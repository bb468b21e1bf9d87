#pragma once

/// @file Readers of the parts of a scenario file.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "emulator/config/config_reader.hpp"
#include "emulator/config/scenario/scenario_file.hpp"
#include "emulator/core/scenario/scenario.hpp"

namespace lk::emulator {

/// As `parse_scenario` in scenario_file.hpp, but from parsed TOML; `file` is the name of the
/// document in messages.
Scenario parse_scenario(const toml::table& document, const std::string& file,
                        std::optional<std::uint64_t> seed, const ScenarioFiles& files);

/// Reads a [[send]]: one HostSend for a raw frame, for each drive, or for each frame of a log.
std::vector<HostSend> read_send(TableReader& reader, const Scenario& scenario,
                                const ScenarioFiles& files);
/// Reads an [[expect]].
Expectation read_expectation(TableReader& reader, const Scenario& scenario);

/// Returns the index in `robot` of the bus that the key `bus` names. Without the key: of the only
/// bus, or of the only bus with drive `id`.
std::size_t read_bus_of(TableReader& reader, const std::vector<BusConfig>& robot,
                        std::optional<int> id);
/// Reads a time, which must not be after the scenario's end.
std::optional<SimTime> read_moment(TableReader& reader, const std::string& key, SimTime duration);

}  // namespace lk::emulator
