#pragma once

#include <string>

#include "emulator/config/config_error.hpp"
#include "emulator/core/bus_config.hpp"

namespace lk::emulator {

/// Whose ROM a file holds.
struct RomOwner {
  std::string bus;
  int id = 1;
  std::string motor;

  friend bool operator==(const RomOwner&, const RomOwner&) = default;
};

/// What the parameter is called in a ROM file.
const char* rom_key(RomParameter parameter);

/// A ROM file (docs/rom.md): the parameters that were written, and how often. What nobody wrote is
/// left to the configuration.
std::string print_rom(const RomOwner& owner, const Registers& rom, const RomWear& wear);

/// Puts what the ROM file `text` holds over `servo.rom` and `servo.wear`. Throws ConfigError when
/// it is damaged, or belongs to another drive than this one on `bus`.
void read_rom(const std::string& text, const std::string& file, const std::string& bus,
              ServoConfig& servo);

/// The name of the file of a drive of `bus`.
std::string rom_file_name(const std::string& bus, int id);

}  // namespace lk::emulator
