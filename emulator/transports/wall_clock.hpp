#pragma once

#include <chrono>

namespace lk::emulator {

/// What frames that came by no CAN socket are stamped with.
inline std::chrono::nanoseconds wall_now() {
  return std::chrono::system_clock::now().time_since_epoch();
}

}  // namespace lk::emulator
