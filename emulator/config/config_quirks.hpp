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

/// Returns the words that files and options accept for a generation: the names, and "seen".
std::vector<std::string> generation_words();

/// Thrown for the generation "seen" if the generation of real drives of this motor is unknown.
struct NeverSeen : std::invalid_argument {
  using std::invalid_argument::invalid_argument;
};

/// Returns the generation for `word`: its name, or "seen" for the one that drives of this motor
/// were seen to use. Ignores case. Throws std::invalid_argument, NeverSeen.
Generation chosen_generation(const std::string& word, const Profile& profile);

/// Reads `generation` and [quirks] of a drive: the preset, then each switch that differs. `asked`
/// holds the options of the command line, which override the file key by key. `drive`, e.g. "vcan0
/// drive 1", is for messages. Pre: `servo.profile` is set; it gives the seen generation, the
/// series, and the default of `encoder_span`. Changes the profile to the encoder and the loops of
/// such drives. Throws ConfigError. An error in `asked` throws std::invalid_argument, or a
/// ConfigError that names the option instead of the file.
void read_generation(TableReader& reader, const FirmwareRequest& asked, const std::string& drive,
                     ServoConfig& servo);

/// Gives the profile the encoder that `encoder_bits` asks for. Call after all changes of the
/// profile.
void apply_encoder_bits(ServoConfig& servo);

}  // namespace lk::emulator
