#pragma once

#include <optional>

#include "tools/identify/balance_fit.hpp"
#include "tools/identify/estimate.hpp"

namespace lk::emulator {

/// The gains of the speed loop as they were while the log was written, at the rotor.
struct SpeedLoopFit {
  std::optional<Estimate> kp_A_s;  // per rad
  std::optional<Estimate> ki_A;    // per rad
};

/// From how the loop answers cogging where it holds a speed: cogging of order n shakes the shaft at
/// n·ω, and of iq = −(Kp + Ki/s)·ω the log has both sides.
SpeedLoopFit fit_speed_loop(const Track& track, const BalanceFit& balance);

}  // namespace lk::emulator
