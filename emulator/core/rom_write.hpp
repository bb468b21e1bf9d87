#pragma once

#include <cstdint>

#include "emulator/core/bus_config.hpp"

namespace lk::emulator {

/// Full contents of a drive's ROM after a write. The shell stores them; the acknowledging reply
/// (TimedFrame::after_rom_write) may leave when they are durable.
struct RomWrite {
  std::uint64_t number = 0;  // from 1, per drive
  int id = 1;                // of the drive
  Registers rom;
  RomWear wear{};
};

}  // namespace lk::emulator
