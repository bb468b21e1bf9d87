#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <optional>

namespace robot {

struct CanFrame {
  std::uint32_t id = 0;
  std::array<std::uint8_t, 8> data{};
};

/// The robot code's interface to the outside: frames and time. On the robot it is a CAN socket and
/// a clock, in tests a VirtualCan.
class CanPort {
 public:
  virtual ~CanPort() = default;
  virtual void send(const CanFrame& frame) = 0;
  /// Returns the next frame, or none within `timeout`.
  virtual std::optional<CanFrame> receive(std::chrono::microseconds timeout) = 0;
  virtual void wait(std::chrono::microseconds duration) = 0;
};

}  // namespace robot
