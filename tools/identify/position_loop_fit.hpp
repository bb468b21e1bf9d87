#pragma once

#include <optional>

#include "tools/identify/balance_fit.hpp"
#include "tools/identify/speed_loop_fit.hpp"

namespace lk::emulator {

/// Kp of the position loop, from moves: the emulator makes them with the mechanics that the balance
/// has found, and the gain is the one with which its shaft follows the log's (Levenberg and
/// Marquardt).
struct PositionLoopFit {
  Estimate angle_kp_per_s;
  double rms_rad = 0;                                    // of what is left
  std::vector<double> time_s, logged_rad, emulated_rad;  // for a picture
};

/// Nothing where the log has no moves to absolute angles.
std::optional<PositionLoopFit> fit_position_loop(const Track& track, const BalanceFit& balance,
                                                 const SpeedLoopFit& speed);

}  // namespace lk::emulator
