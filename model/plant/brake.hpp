#pragma once

/// @file Power-off brake: the spring closes the brake within `engage_time`, the coil opens it
/// within `release_time` (docs/internals/model.md §4).

#include <algorithm>

#include "model/drive_params.hpp"

namespace lk::model {

struct BrakeState {
  bool coil_on = false;
  double pressed = 1.0;         // 0..1, share of the brake's torque in force
  double since_switched = 1e9;  // s, since the coil was switched

  void switch_coil(bool on) {
    if (on == coil_on) return;
    coil_on = on;
    since_switched = 0.0;
  }
  /// Returns true until the brake begins to move, `delay` seconds after the coil was switched.
  bool waits(double delay) const {
    return since_switched < delay && pressed != (coil_on ? 0.0 : 1.0);
  }
};

/// Advances by `T` seconds; returns true if the torque changed. The torque changes linearly
/// (assumed), from `delay` seconds after the coil was switched.
inline bool move_brake(const BrakeParams& p, double T, BrakeState& s, double delay = 0.0) {
  const bool waits = s.waits(delay);
  s.since_switched += T;
  if (waits) return false;
  const double before = s.pressed;
  const double time = s.coil_on ? p.release_time : p.engage_time;
  const double step = time > 0.0 ? T / time : 1.0;
  s.pressed = std::clamp(s.pressed + (s.coil_on ? -step : step), 0.0, 1.0);
  return s.pressed != before;
}

}  // namespace lk::model
