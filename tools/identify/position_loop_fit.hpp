#pragma once

#include <optional>

#include "tools/identify/balance_fit.hpp"
#include "tools/identify/speed_loop_fit.hpp"

namespace lk::emulator {

/// The gains of the position loop, and of the speed loop within it, from moves: the emulator makes
/// them with the mechanics that the balance has found, and the gains are those with which its shaft
/// follows the log's (Levenberg and Marquardt).
struct PositionLoopFit {
  Estimate angle_kp_per_s;
  Estimate speed_kp_A_s;  // per rad; with what the speed loop's own fit says
  Estimate speed_ki_A;    // per rad; the same
  double rms_rad = 0;     // of what is left
  std::vector<double> time_s, logged_rad, emulated_rad;  // for a picture
};

/// Nothing where the log has no moves to absolute angles.
std::optional<PositionLoopFit> fit_position_loop(const Track& track, const BalanceFit& balance,
                                                 const SpeedLoopFit& speed);

/// The drive with the mechanics that the balance has found, in Nm with the k_t of its motor file.
ServoConfig with_mechanics(const ServoConfig& servo, const BalanceFit& balance);

}  // namespace lk::emulator
