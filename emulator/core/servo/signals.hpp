#pragma once

/// @file What can be watched of a drive: the one table behind conditions, expectations, CSV files
/// and telemetry. body_signals.hpp has that of bodies.

#include <cstddef>
#include <span>
#include <string_view>

#include "emulator/core/body_state.hpp"
#include "emulator/core/servo/servo.hpp"

namespace lk::emulator {

/// A drive at one instant: what it knows of itself, and what is so.
struct DriveView {
  const Servo& servo;
  model::Telemetry telemetry;
  model::Truth truth;
  JointState joint{};
  const BodyState* body = nullptr;  // that drives of its bus are on; null: none
};

struct Signal {
  std::string_view name;  // "speed_dps"
  std::string_view about;
  double (*of_drive)(const DriveView& drive);  // null: it is the body's
  double (*of_body)(const BodyState& body, std::size_t part) = nullptr;
  std::size_t part = 0;

  bool is_of_body() const { return of_drive == nullptr; }
  /// Of the body through any drive of its buses.
  double read(const DriveView& drive) const {
    return is_of_body() ? of_body(*drive.body, part) : of_drive(drive);
  }
};

/// All of a drive, in the order of listings.
std::span<const Signal> signals();

/// None: null.
const Signal* find_signal(std::string_view name);

/// The word for an error bit, as configuration files have it: "under_voltage".
std::string_view error_word(model::Error error);

}  // namespace lk::emulator
