#pragma once

#include <cstdint>
#include <optional>

#include "emulator/advice/advice.hpp"
#include "emulator/advice/heard.hpp"

namespace lk::emulator {

/// Errors cleared again and again because the reply shows those from before.
class ClearWatch {
 public:
  static constexpr SimTime kWithin = std::chrono::seconds(5);
  static constexpr int kTimes = 3;

  std::optional<Finding> hear(const Heard& heard, const KnownDrive& drive);

 private:
  SimTime first_{0};
  int times_ = 0;
};

/// The first target after a start, for a turn count that the drive no longer has.
class FirstTargetWatch {
 public:
  static constexpr double kFar_deg = 180;

  std::optional<Finding> hear(const Heard& heard, const KnownDrive& drive);

 private:
  std::uint32_t known_start_ = 0;  // since which the host knows where the shaft is, or has moved
};

}  // namespace lk::emulator
