#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

#include "host/can_port.hpp"

namespace robot {

/// State reported by the drive.
struct Health {
  int temperature_C = 0;
  double voltage_V = 0;
  bool under_voltage = false;
  bool too_hot = false;

  bool well() const { return !under_voltage && !too_hot; }
};

/// A joint on an LK-TECH drive without gear; the angle counts turns.
class ShoulderJoint {
 public:
  ShoulderJoint(CanPort& port, int drive_id);

  // No value, or false, means that the drive did not answer.
  std::optional<double> angle_deg();
  std::optional<Health> health();
  /// Starts a move and returns; the drive completes it.
  bool move_to(double target_deg, int speed_dps);
  /// After a protection has tripped: clears errors that are over and enables the drive again.
  bool recover();

  /// Moves and waits. Returns false if the joint has not arrived by `timeout` or does not answer.
  bool move_and_wait(double target_deg, int speed_dps, std::chrono::milliseconds timeout);

 private:
  std::optional<CanFrame> ask(const CanFrame& query);
  CanFrame query(std::uint8_t command) const;

  CanPort& port_;
  std::uint32_t can_id_;
};

}  // namespace robot
