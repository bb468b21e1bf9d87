#pragma once

#include <optional>

#include "emulator/advice/advice.hpp"
#include "emulator/advice/heard.hpp"

namespace lk::emulator {

/// Detects positions that are sent as speeds. Such a host changes the value when the shaft reaches
/// it, or starts a path at the shaft's position.
class SpeedWatch {
 public:
  static constexpr double kLeast_dps = 5;                           // assumed
  static constexpr SimTime kHeld = std::chrono::milliseconds(100);  // assumed
  static constexpr int kArrivals = 3;                               // assumed: twice may be chance
  static constexpr double kNear_deg = 2;       // plus the travel within kReaction_s (assumed)
  static constexpr double kReaction_s = 0.02;  // of a host that reads at 50 Hz (assumed)
  static constexpr SimTime kJustRead = std::chrono::seconds(1);  // assumed
  static constexpr double kStart_deg = 0.3;  // includes the first step of a path (assumed)
  static constexpr double kStep_dps = 5;     // per step of a path (assumed)
  static constexpr int kSteps = 10;          // assumed

  std::optional<Finding> hear(const Heard& heard, const KnownDrive& drive);

 private:
  bool starts_at_shaft(double value, SimTime at, const KnownDrive& drive) const;
  std::optional<Finding> follow_path(double value);
  std::optional<Finding> leave_target(double value, SimTime at, const KnownDrive& drive);

  std::optional<SimTime> angle_read_;
  std::optional<double> value_;  // in force
  SimTime since_{0};
  int arrivals_ = 0;
  double arrived_dps_ = 0;    // size of the last value that arrived
  std::optional<int> steps_;  // of a path that began at the shaft
};

}  // namespace lk::emulator
