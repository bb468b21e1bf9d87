#pragma once

#include <array>
#include <optional>

#include "emulator/advice/advice.hpp"
#include "emulator/advice/heard.hpp"

namespace lk::emulator {

/// Several hosts that command one drive. Nothing on CAN says who sent a frame, but one host does
/// not go there and back within the time of two commands, again and again, and several do nothing
/// else.
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
  bool there_and_back(const Said& now) const;

  std::array<Said, 2> before_{};  // the last, and the one before that
  int known_ = 0;
  int times_ = 0;
  SimTime last_time_{0};
};

}  // namespace lk::emulator
