#pragma once

#include "emulator/files/json_table.hpp"
#include "emulator/live/line.hpp"

namespace lk::emulator {

/// Sends frames as a host does. `said` has the form of a scenario's [[send]] without its times.
/// Returns the answer. Throws ApiError or ConfigError before anything is sent.
Json send_frames(const Json& said, Line& line);

}  // namespace lk::emulator
