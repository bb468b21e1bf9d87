#pragma once

#include <chrono>

namespace lk::emulator {

/// Time stamp of frames that came by no CAN socket.
inline std::chrono::nanoseconds wall_now() {
  return std::chrono::system_clock::now().time_since_epoch();
}

}  // namespace lk::emulator
