#pragma once

#include <string>
#include <vector>

#include "emulator/files/json_table.hpp"
#include "emulator/live/line.hpp"

namespace lk::emulator {

/// Reads a request in the words of directives. Nothing is done yet; whatever would not do is
/// refused here. Throws ConfigError, JsonError, ApiError.
std::vector<TimedDirective> read_request(const Json& said, const Line& line);

/// Does it, or plans it; returns the names that faults were given.
std::vector<std::string> perform_all(const std::vector<TimedDirective>& directives, Line& line);

}  // namespace lk::emulator
