#pragma once

#include <filesystem>
#include <optional>

namespace lk::emulator {

/// Where ROM is kept.
struct RomOptions {
  std::optional<std::filesystem::path> directory;  // absent: the user's state directory, by bus
  bool in_memory = false;                          // nowhere
  bool wipe = false;                               // start from factory state
};

}  // namespace lk::emulator
