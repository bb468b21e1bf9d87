#pragma once

#include <stdexcept>
#include <string>
#include <vector>

#include "emulator/config/config.hpp"
#include "emulator/config/config_reader.hpp"
#include "emulator/core/bus_config.hpp"

namespace lk::emulator {

/// The switches of `quirks` that the preset of `generation` has otherwise, as a configuration file
/// says them: "pid_commands = true".
std::vector<std::string> switches_beside(Generation generation, const Quirks& quirks);

/// What files and options take for a generation: the names, and "seen".
std::vector<std::string> generation_words();

/// "seen" was asked for, and of the motor nothing is known.
struct NeverSeen : std::invalid_argument {
  using std::invalid_argument::invalid_argument;
};

/// The generation that files and options mean by `word`: its name, or "seen", what drives of this
/// motor were seen to speak; case does not count. Throws std::invalid_argument, NeverSeen.
Generation chosen_generation(const std::string& word, const Profile& profile);

/// Reads `generation` and [quirks] of a drive: the preset, and every switch that differs from it.
/// What `asked` says wins, key by key; `drive`, "vcan0 drive 1", is for messages. The profile must
/// be the drive's: it knows what was seen, its series decides what makes sense, and its
/// `encoder_span` is one of the switches. Throws ConfigError; of what is wrong with `asked`,
/// std::invalid_argument or a ConfigError that names the option in place of the file.
void read_generation(TableReader& reader, const FirmwareRequest& asked, const std::string& drive,
                     ServoConfig& servo);

}  // namespace lk::emulator
