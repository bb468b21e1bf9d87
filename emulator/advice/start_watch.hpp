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
  /// The drive was just looked at.
  void look(const KnownDrive& drive);

 private:
  std::uint32_t known_start_ = 0;  // since which the host knows where the shaft is, or has moved
  std::uint32_t start_ = 0;        // of the drive, at the last look
  double angle_deg_ = 0;           // at the last look
  std::optional<double> angle_before_deg_;  // when the drive last ran before this start
};

}  // namespace lk::emulator
