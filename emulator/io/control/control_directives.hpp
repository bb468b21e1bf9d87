#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "emulator/files/json_table.hpp"
#include "emulator/io/live/line.hpp"

namespace lk::emulator {

/// Limit for directives that clients have planned on a bus.
inline constexpr std::size_t kMaxPlanned = 1000;

/// Executes or plans the directives in `request`, and notifies listeners. Returns the names of new
/// faults. Checks all directives before it executes the first. Throws ConfigError, JsonError,
/// ApiError.
std::vector<std::string> request_all(const Json& request, Line& line);

/// Sends frames as a host does. `request` has the form of a scenario's [[send]] without its times.
/// Returns the answer. Throws ApiError or ConfigError before anything is sent.
Json send_frames(const Json& request, Line& line);

}  // namespace lk::emulator
