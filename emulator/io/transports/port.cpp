#include "emulator/io/transports/port.hpp"

#include <algorithm>
#include <ctime>

#include "emulator/io/transports/socketcan.hpp"

namespace lk::emulator {

bool wait_for_frames(std::span<pollfd> sockets, std::chrono::nanoseconds timeout) {
  timeout = std::max(timeout, std::chrono::nanoseconds(0));
  const auto seconds = std::chrono::floor<std::chrono::seconds>(timeout);
  const timespec interval{static_cast<time_t>(seconds.count()),
                          static_cast<long>((timeout - seconds).count())};
  return ::ppoll(sockets.data(), sockets.size(), &interval, nullptr) > 0;
}

}  // namespace lk::emulator
