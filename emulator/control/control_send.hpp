#pragma once

#include "emulator/files/json_table.hpp"
#include "emulator/live/line.hpp"

namespace lk::emulator {

/// Puts what `said` describes in the words of a scenario's [[send]], without its times, on the bus
/// now, as a host does. Gives the answer. Throws ApiError or ConfigError, and then nothing is sent.
Json send_frames(const Json& said, Line& line);

}  // namespace lk::emulator
