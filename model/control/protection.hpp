#pragma once

/// @file Protections: watch quantities, count delays, latch errors (docs/internals/model.md §12).
/// Reset, boot and brown-out of the controller (§13).

#include <array>
#include <cstdint>

#include "model/drive_params.hpp"
#include "model/setpoint.hpp"

namespace lk::model {

enum class Life : std::uint8_t { kInReset, kBooting, kAlive };

struct LifeState {
  Life life = Life::kAlive;
  double boot_left = 0;  // s
};

/// Advances reset supervisor and boot by `T` seconds, with `v_link` volts at the link. Returns true
/// if the controller came alive or died.
bool live(const LogicParams& p, double v_link, double T, LifeState& s);

/// Measurements for the protections, once per motion-loop period.
struct Watched {
  double v_bus = 0;         // V
  double temp_motor = 0;    // °C
  double temp_driver = 0;   // °C
  double i_peak = 0;        // A, largest of the three phases
  bool near_limit = false;  // see near_limit()
  double omega = 0;         // rad/s
};

struct ProtectionState {
  std::array<double, kErrorKinds> beyond_for{};  // s since each quantity went beyond its threshold
  double silent_for = 0;                         // s since the last accepted frame
  double stalled_for = 0;                        // s since standstill near the limit began
  ErrorBits enabled = 0;                         // enabled protections, set by `settings_changed`
  ErrorBits cause = 0;                           // tripped and not yet back by the hysteresis
  ErrorBits latched = 0;
};

/// Runs one period of `T_m` seconds and latches errors. Returns true if a protection tripped now.
bool watch(const std::array<Protection, kErrorKinds>& settings, const Watched& watched, double T_m,
           ProtectionState& s);

/// Call before the first `watch` and after a change of the settings. Resets timers and causes of
/// disabled protections; latched errors stay latched.
void settings_changed(const std::array<Protection, kErrorKinds>& settings, ProtectionState& s);

/// Restarts the time-out of kLostInput and ends its cause. Call on each accepted frame. An error
/// that is already latched stays latched.
void feed_input(ProtectionState& s);

/// Clears latched errors whose cause has ended, except errors that are not `recoverable`.
void clear_errors(const std::array<Protection, kErrorKinds>& settings, ProtectionState& s);

}  // namespace lk::model
