#pragma once

/// @file TOML as text, its numbers as short as they read back the same. toml++ writes 0.1 as
/// 0.10000000000000001.

#include <string>

#include "emulator/config/config_reader.hpp"

namespace lk::emulator {

/// A file: keys, then `[[…]]` for each array of tables. All tables within these are on one line.
std::string toml_text(const toml::table& document);

/// The keys of a table, a line each: `reply = { error = "stall" }`.
std::string toml_lines(const toml::table& table);

}  // namespace lk::emulator
