#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "emulator/advice/advice.hpp"
#include "emulator/advice/heard.hpp"

namespace lk::emulator {

/// Several hosts that command one drive. Nothing on CAN says who sent a frame, and what one host
/// sends may go there and back: dither, a blip when it was held up, noise. But it sends one frame
/// after the other: another value takes the place of the usual one, and the rhythm of the usual
/// ones has a gap there. A second host's frame comes between, and leaves that rhythm as it is.
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
  static constexpr std::size_t kRhythm = 7;  // frames that make one (assumed)
  const Said& back(std::size_t n) const { return said_[(count_ - 1 - n) % kKept]; }  // 0: the last
  bool apart() const;
  bool alike(const MotionCommand& one, const MotionCommand& other) const;
  enum class Sign : std::uint8_t { kNone, kOneHost, kSeveral };
  Sign sign() const;

  std::array<Said, kKept> said_{};  // a ring
  std::size_t count_ = 0;
  int times_ = 0;  // what speaks for several, less what speaks for one
  SimTime last_time_{0};
};

}  // namespace lk::emulator
