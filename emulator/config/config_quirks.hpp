#pragma once

#include <string>
#include <vector>

#include "emulator/config/config_reader.hpp"
#include "emulator/core/bus_config.hpp"

namespace lk::emulator {

/// The switches of `quirks` that the preset of `generation` has otherwise, as a configuration file
/// says them: "pid_commands = true".
std::vector<std::string> switches_beside(Generation generation, const Quirks& quirks);

/// Reads `generation` and [quirks] of a drive: the preset, and every switch that differs from it.
/// The profile must be the drive's: its series decides what makes sense, and its `encoder_span`
/// is one of the switches.
void read_generation(TableReader& reader, ServoConfig& servo);

}  // namespace lk::emulator
