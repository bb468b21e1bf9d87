#pragma once

#include <filesystem>
#include <optional>

namespace lk::emulator {

/// Storage of ROM.
struct RomOptions {
  std::optional<std::filesystem::path> directory;  // absent: the user's state directory, by bus
  bool in_memory = false;                          // do not save
  bool wipe = false;                               // start from factory state
};

}  // namespace lk::emulator
