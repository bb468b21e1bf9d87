#pragma once

/// @file Signals of a drive: the table behind conditions, expectations, CSV files and telemetry.
/// Those of bodies: body_signals.hpp.

#include <cstddef>
#include <span>
#include <string_view>

#include "emulator/core/body_state.hpp"
#include "emulator/core/servo/servo.hpp"

namespace lk::emulator {

/// A drive at one instant: its telemetry, and the true state.
struct DriveView {
  const Servo& servo;
  model::Telemetry telemetry;
  model::Truth truth;
  JointState joint{};
  const BodyState* body = nullptr;  // body that drives of its bus move; null: none
};

struct Signal {
  std::string_view name;  // "speed_dps"
  std::string_view about;
  double (*of_drive)(const DriveView& drive);  // null: a signal of the body
  double (*of_body)(const BodyState& body, std::size_t part) = nullptr;
  std::size_t part = 0;

  bool is_of_body() const { return of_drive == nullptr; }
  /// Reads a body signal through any drive of its buses.
  double read(const DriveView& drive) const {
    return is_of_body() ? of_body(*drive.body, part) : of_drive(drive);
  }
};

/// All signals of a drive, in the order of listings.
std::span<const Signal> signals();

/// Returns null if unknown.
const Signal* find_signal(std::string_view name);

/// Name of an error bit in configuration files: "under_voltage".
std::string_view error_word(model::Error error);

}  // namespace lk::emulator
