#pragma once

#include <string>

#include "emulator/core/sim_time.hpp"

namespace lk::emulator {

/// Formats as "1.25 s", to the nanosecond.
std::string time_text(SimTime time);
/// Formats as a number of seconds: "1.25".
std::string seconds_text(SimTime time);

}  // namespace lk::emulator
