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

/// Returns the text of a ROM file (docs/reference/configuration.md): the parameters that were
/// written, and how often. Others are left out; their values come from the configuration.
std::string print_rom(const RomOwner& owner, const Registers& rom, const RomWear& wear);

/// Overrides `servo.rom` and `servo.wear` with the ROM file `text`, and sets `servo.boot_offset` to
/// the configured offset. Throws ConfigError if the file is damaged or belongs to another drive
/// than `servo` on `bus`.
void read_rom(const std::string& text, const std::string& file, const std::string& bus,
              ServoConfig& servo);

/// Returns the file name for a drive of `bus`.
std::string rom_file_name(const std::string& bus, int id);

}  // namespace lk::emulator
