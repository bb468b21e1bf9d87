#pragma once

#include <string>

#include "emulator/config/config_error.hpp"
#include "emulator/core/bus_config.hpp"

namespace lk::emulator {

/// The drive to which a ROM file belongs.
struct RomOwner {
  std::string bus;
  int id = 1;
  std::string motor;

  friend bool operator==(const RomOwner&, const RomOwner&) = default;
};

/// Returns the key of a parameter in a ROM file.
const char* rom_key(RomParameter parameter);

/// Returns a ROM file (docs/reference/configuration.md): parameters that were written, and how
/// often. Others come from the configuration.
std::string print_rom(const RomOwner& owner, const Registers& rom, const RomWear& wear);

/// Overrides `servo.rom` and `servo.wear` with the ROM file `text`. Throws ConfigError if the file
/// is damaged or belongs to another drive than this one on `bus`.
void read_rom(const std::string& text, const std::string& file, const std::string& bus,
              ServoConfig& servo);

/// Returns the file name for a drive of `bus`.
std::string rom_file_name(const std::string& bus, int id);

}  // namespace lk::emulator
