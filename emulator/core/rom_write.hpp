#pragma once

#include <cstdint>

#include "emulator/core/bus_config.hpp"

namespace lk::emulator {

/// Full contents of a drive's ROM after a write. The shell stores them. It sends the reply that
/// acknowledges the write (TimedFrame::after_rom_write) only when the contents are durable.
struct RomWrite {
  std::uint64_t number = 0;  // from 1, per drive
  int id = 1;                // of the drive
  Registers rom;
  RomWear wear{};
};

}  // namespace lk::emulator
