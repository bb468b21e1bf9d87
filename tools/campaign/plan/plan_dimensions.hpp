#pragma once

/// @file How the [dimension]s and [[exclude]]s of a plan are read.

#include <string>
#include <vector>

#include "emulator/config/config_reader.hpp"
#include "tools/campaign/plan/plan.hpp"

namespace lk::emulator {

/// What [dimension] has, in the order of the file. `kinds`: what "all" means for fault.kind.
/// Throws ConfigError.
std::vector<Dimension> read_dimensions(const toml::table& table, const std::string& file,
                                       const std::vector<std::string>& kinds);
/// One [[exclude]] of these dimensions. Throws ConfigError.
Exclusion read_exclusion(const toml::table& table, const std::string& file,
                         const std::vector<Dimension>& dimensions);

}  // namespace lk::emulator
