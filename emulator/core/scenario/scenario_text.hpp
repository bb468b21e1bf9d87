#pragma once

/// @file Text of scenarios, for reports.

#include <string>

#include "emulator/core/scenario/scenario.hpp"
#include "emulator/core/scenario/scenario_run.hpp"
#include "emulator/core/sim_time.hpp"

namespace lk::emulator {

/// Formats with six significant digits.
std::string number_text(double value);
/// "off", "stopped", "running".
std::string state_word(RunState state);
/// "vcan0 drive 1 turned by 86° (output), at up to 1697 dps, 3 J, from 2 s: no angle received since
/// the error".
std::string unasked_text(const WorstMotion& worst);
/// "vcan0 drive 1: speed_dps 90 to 110 at 2 s".
std::string expectation_text(const Expectation& expectation, const std::string& interface);

}  // namespace lk::emulator
