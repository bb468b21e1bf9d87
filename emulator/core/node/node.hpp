#pragma once

/// @file A drive on a bus: what answers, what it does over time besides, its controller, its motor.

#include <cstddef>
#include <optional>
#include <vector>

#include "emulator/core/faults/link_faults.hpp"
#include "emulator/core/rom_write.hpp"
#include "emulator/core/servo/servo.hpp"
#include "emulator/core/sim_time.hpp"

namespace lk::emulator {

/// Where a drive's motor is computed.
struct MotorPlace {
  std::size_t bank;  // of those of its PWM rate
  std::size_t lane;
};

/// What a drive does over time besides answering.
struct Timeline {
  SimTime last_reply{0};  // a drive answers in order
  /// Writes to its memory that are not done yet, and what stood there before each.
  struct Writing {
    SimTime done;
    RomWrite after;
    Registers rom_before;
    RomWear wear_before;
  };
  std::vector<Writing> writing;
  /// Where the supply's voltage is going.
  struct Ramp {
    double from_V, to_V;
    SimTime begin, end;
  };
  double supply_V = 0;
  std::optional<Ramp> ramp;
  std::optional<double> before_sag_V;  // during a sag: what it ends at
  bool alive = true;
};

struct Node {
  Servo servo;
  MotorPlace motor;
  Timeline timeline = {};
  DriveLink link = {};
};

}  // namespace lk::emulator
