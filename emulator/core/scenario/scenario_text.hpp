#pragma once

/// @file Scenarios in words, for reports.

#include <string>

#include "emulator/core/scenario/scenario.hpp"

namespace lk::emulator {

/// Six figures, which is what people read.
std::string number_text(double value);
/// "1.25 s", to the nanosecond.
std::string time_text(SimTime time);
/// The same as a number of seconds: "1.25".
std::string seconds_text(SimTime time);
/// "off", "stopped", "running".
std::string state_word(RunState state);
/// "vcan0 drive 1: speed_dps 90 to 110 at 2 s".
std::string expectation_text(const Expectation& expectation, const std::string& interface);

}  // namespace lk::emulator
