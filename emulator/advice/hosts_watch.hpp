#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "emulator/advice/advice.hpp"
#include "emulator/advice/heard.hpp"

namespace lk::emulator {

/// Detects several hosts that command one drive. A CAN frame does not name its sender, and one host
/// may alternate values (dither, corrections, noise). But one host sends one frame after the other:
/// an unusual value replaces a usual one and leaves a gap in its rhythm. A second host's frame
/// comes in between and leaves the rhythm unchanged.
class HostsWatch {
 public:
  static constexpr SimTime kThereAndBack = std::chrono::milliseconds(100);  // assumed
  static constexpr SimTime kAgain = std::chrono::seconds(1);                // assumed
  static constexpr int kTimes = 8;                                          // assumed

  std::optional<Finding> hear(const Heard& heard);

 private:
  struct Said {
    SimTime at{0};
    MotionCommand motion;
  };
  static constexpr std::size_t kKept = 32;
  static constexpr std::size_t kRhythm = 7;  // frames needed for a rhythm (assumed)
  const Said& back(std::size_t n) const { return said_[(count_ - 1 - n) % kKept]; }  // 0: the last
  bool apart() const;
  bool alike(const MotionCommand& one, const MotionCommand& other) const;
  enum class Sign : std::uint8_t { kNone, kOneHost, kSeveral };
  Sign sign() const;

  std::array<Said, kKept> said_{};  // a ring
  std::size_t count_ = 0;
  int times_ = 0;  // signs of several hosts minus signs of one
  SimTime last_time_{0};
};

}  // namespace lk::emulator
