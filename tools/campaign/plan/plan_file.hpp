#pragma once

/// @file Plan files (docs/campaigns.md): text in, Plan out.

#include <filesystem>
#include <string>

#include "tools/campaign/plan/plan.hpp"

namespace lk::emulator {

/// Reads a plan, and the text of its base scenario: a path from the plan's directory, or the name
/// of a shipped one. Does not look into the scenario. Throws ConfigError, with file and line.
Plan parse_plan(const std::string& text, const std::filesystem::path& file);

/// The plan of this file, or the shipped one of this name. Throws StartError.
Plan load_plan(const std::string& given);

}  // namespace lk::emulator
