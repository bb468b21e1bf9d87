#pragma once

/// @file Protections: quantities watched, delays counted, errors latched (docs/model.md §12).

#include <array>
#include <cstdint>

#include "model/setpoint.hpp"

namespace lk::model {

/// What the firmware measures for its protections, once per motion-loop period.
struct Watched {
  double v_bus = 0;         // V
  double temp_motor = 0;    // °C
  double temp_driver = 0;   // °C
  double i_peak = 0;        // A, largest of the three phases
  bool near_limit = false;  // with about all the limit in force allows
  double omega = 0;         // rad/s
};

struct ProtectionState {
  std::array<double, kErrorKinds>
      beyond_for{};        // s, how long each quantity has been beyond its threshold
  double silent_for = 0;   // s since the last accepted frame
  double stalled_for = 0;  // s at standstill, pushing
  ErrorBits enabled = 0;   // protections that are, by `settings_changed`
  ErrorBits cause = 0;     // beyond, or not yet back by the hysteresis
  ErrorBits latched = 0;
};

/// One period of `T_m` seconds; latches what trips. Returns true if a protection tripped now.
bool watch(const std::array<Protection, kErrorKinds>& settings, const Watched& watched, double T_m,
           ProtectionState& s);

/// Call before the first `watch`, and after a change. Forgets the timers and causes of protections
/// that are no longer enabled; what latched stays.
void settings_changed(const std::array<Protection, kErrorKinds>& settings, ProtectionState& s);

/// An accepted frame has arrived: input is not lost, whatever is latched.
void feed_input(ProtectionState& s);

/// Unlatches every error whose cause is over, and that may be cleared without a power cycle.
void clear_errors(const std::array<Protection, kErrorKinds>& settings, ProtectionState& s);

}  // namespace lk::model
