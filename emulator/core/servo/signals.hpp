#pragma once

/// @file Signals of a drive: the table behind conditions, expectations, CSV files and telemetry.
/// Also the signals of bodies (BodySignals).

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "emulator/core/body_state.hpp"
#include "emulator/core/servo/servo.hpp"
#include "emulator/core/servo/unasked.hpp"

namespace lk::emulator {

/// A drive at one instant: its telemetry and its true state.
struct DriveView {
  const Servo& servo;
  model::Telemetry telemetry;
  model::Truth truth;
  const Unasked& unasked;
  JointState joint{};
  const BodyState* body = nullptr;  // body that drives of the same bus move; null: no body
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

/// Signals of a body: "body.fallen", and for each part "body.trunk.z_m". One object for all buses
/// of a robot; its signals are valid while it exists.
class BodySignals {
 public:
  /// `parts`: names in Mechanism::parts(). A part has no signals if its name is empty or cannot be
  /// in a comma list. `beginning`: initial state of the body.
  BodySignals(std::span<const std::string> parts, BodyState beginning);
  BodySignals(const BodySignals&) = delete;
  BodySignals& operator=(const BodySignals&) = delete;
  ~BodySignals() = default;

  std::span<const Signal> all() const { return signals_; }
  const BodyState& beginning() const { return beginning_; }

 private:
  std::vector<std::string> names_;
  std::vector<Signal> signals_;
  BodyState beginning_;
};

/// Row of the table behind BodySignals.
struct BodySignal {
  std::string_view name;  // "z_m", of a part; "fallen"
  std::string_view about;
  double (*read)(const BodyState& body, std::size_t part);
  bool of_part;
};
std::span<const BodySignal> body_signal_table();

/// Prefix of the names of body signals.
inline constexpr std::string_view kBodyPrefix = "body.";

/// Returns all signals of a drive, and those of `body` unless it is null.
std::vector<const Signal*> signals_with(const BodySignals* body);

}  // namespace lk::emulator
