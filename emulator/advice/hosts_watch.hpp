#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "emulator/advice/advice.hpp"
#include "emulator/advice/heard.hpp"

namespace lk::emulator {

/// Several hosts that command one drive. Nothing on CAN says who sent a frame, but one host does
/// not go there and back within the time of a few commands, again and again, and several do nothing
/// else. Noise does so by chance: what is there, and what is back, has to be steady.
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
  static constexpr std::size_t kKept = 6;
  const Said& back(std::size_t n) const { return said_[(count_ - 1 - n) % kKept]; }  // 0: the last
  bool alike(std::size_t a, std::size_t b) const;
  bool apart() const;
  bool there_and_back() const;

  std::array<Said, kKept> said_{};  // a ring
  std::size_t count_ = 0;
  int times_ = 0;
  SimTime last_time_{0};
};

}  // namespace lk::emulator
