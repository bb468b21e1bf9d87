#pragma once

#include <cstdint>

#include "emulator/core/bus_config.hpp"

namespace lk::emulator {

/// A drive has written its ROM: what stands there now, all of it. The shell keeps it; the reply
/// that acknowledges it (TimedFrame::after_rom_write) may leave when it is durable.
struct RomWrite {
  std::uint64_t number = 0;  // from 1, of this drive
  int id = 1;                // the drive
  Registers rom;
  RomWear wear{};
};

}  // namespace lk::emulator
