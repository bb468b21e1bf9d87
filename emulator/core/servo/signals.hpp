#pragma once

/// @file What can be watched of a drive: the one table behind conditions, expectations, CSV files
/// and telemetry.

#include <span>
#include <string_view>

#include "emulator/core/servo/servo.hpp"

namespace lk::emulator {

/// A drive at one instant: what it knows of itself, and what is so.
struct DriveView {
  const Servo& servo;
  model::Telemetry telemetry;
  model::Truth truth;
  JointState joint{};
};

struct Signal {
  std::string_view name;  // "speed_dps"
  std::string_view about;
  double (*read)(const DriveView& drive);
};

/// All of them, in the order of listings.
std::span<const Signal> signals();

/// None: null.
const Signal* find_signal(std::string_view name);

/// The word for an error bit, as configuration files have it: "under_voltage".
std::string_view error_word(model::Error error);

}  // namespace lk::emulator
