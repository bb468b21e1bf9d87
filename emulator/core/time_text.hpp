#pragma once

#include <string>

#include "emulator/core/sim_time.hpp"

namespace lk::emulator {

/// "1.25 s", to the nanosecond.
std::string time_text(SimTime time);
/// The same as a number of seconds: "1.25".
std::string seconds_text(SimTime time);

}  // namespace lk::emulator
