#pragma once

#include <cstddef>
#include <cstdint>

#include "emulator/core/rom_write.hpp"

namespace lk::emulator {

/// Returns the `number`-th write of the drive `id`; its contents derive from `number`.
inline RomWrite rom_write(int id, std::uint64_t number) {
  RomWrite write;
  write.number = number;
  write.id = id;
  write.rom.encoder_offset = static_cast<std::uint16_t>(number);
  write.wear[static_cast<std::size_t>(RomParameter::kEncoderOffset)] =
      static_cast<std::uint32_t>(number);
  return write;
}

}  // namespace lk::emulator
