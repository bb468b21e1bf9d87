#pragma once

#include <stdexcept>
#include <string>
#include <vector>

#include "emulator/config/config.hpp"
#include "emulator/config/config_reader.hpp"
#include "emulator/core/bus_config.hpp"

namespace lk::emulator {

/// Returns the switches that differ from the preset of `generation`, in the form of a configuration
/// file: "pid_commands = true".
std::vector<std::string> differing_switches(Generation generation, const Quirks& quirks);

/// Words for a generation in files and options: the names, and "seen".
std::vector<std::string> generation_words();

/// "seen" was requested, but no firmware of this motor was seen.
struct NeverSeen : std::invalid_argument {
  using std::invalid_argument::invalid_argument;
};

/// Returns the generation for `word`: its name, or "seen" for the one that drives of this motor
/// were seen to use. Ignores case. Throws std::invalid_argument, NeverSeen.
Generation chosen_generation(const std::string& word, const Profile& profile);

/// Reads `generation` and [quirks] of a drive: the preset, then each switch that differs. `asked`
/// overrides single keys. `drive`, e.g. "vcan0 drive 1", is for messages. Pre: the profile is set:
/// it has the seen generation, the series, and the default of `encoder_span`. Throws ConfigError.
/// An error in `asked` throws std::invalid_argument, or a ConfigError with the option instead of
/// the file.
void read_generation(TableReader& reader, const FirmwareRequest& asked, const std::string& drive,
                     ServoConfig& servo);

}  // namespace lk::emulator
