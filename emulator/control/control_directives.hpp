#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "emulator/files/json_table.hpp"
#include "emulator/live/line.hpp"

namespace lk::emulator {

/// Directives that clients have planned for later on a bus.
inline constexpr std::size_t kMostPlanned = 1000;

/// Does, or plans, what `said`, a request in the words of directives, says, and tells those who
/// listen; returns the names that faults were given. Whatever would not do is refused before
/// anything is done. Throws ConfigError, JsonError, ApiError.
std::vector<std::string> request_all(const Json& said, Line& line);

}  // namespace lk::emulator
