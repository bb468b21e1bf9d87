#pragma once

#include <cstdint>
#include <optional>

#include "emulator/advice/advice.hpp"
#include "emulator/advice/heard.hpp"

namespace lk::emulator {

/// Detects repeated clearing of errors because the reply shows the old errors.
class ClearWatch {
 public:
  static constexpr SimTime kWithin = std::chrono::seconds(5);
  static constexpr int kTimes = 3;

  std::optional<Finding> hear(const Heard& heard, const KnownDrive& drive);

 private:
  SimTime first_{0};
  int times_ = 0;
};

/// Detects a first target after a start that relies on the turn count of before.
class FirstTargetWatch {
 public:
  static constexpr double kFar_deg = 180;

  std::optional<Finding> hear(const Heard& heard, const KnownDrive& drive);
  /// Call after each look at the drive.
  void look(const KnownDrive& drive);

 private:
  std::uint32_t known_start_ = 0;  // start since which the host knows the position or has moved
  std::uint32_t start_ = 0;        // start count at the last look
  double angle_deg_ = 0;           // at the last look
  std::optional<double> angle_before_deg_;  // last angle before this start
};

}  // namespace lk::emulator
