#pragma once

/// @file What the balance of torques tells of a drive's mechanics, with intervals.

#include <optional>
#include <vector>

#include "tools/identify/estimate.hpp"
#include "tools/identify/torque_balance.hpp"

namespace lk::emulator {

/// Cogging of one order: per turn of the rotor, and its amplitude.
struct Cogging {
  int order = 0;
  Estimate amplitude_A;
  double phase_rad = 0;
};

/// How good the fit is where it was not made.
struct BalanceCheck {
  std::size_t windows = 0;
  std::size_t commanded = 0;   // of which the torque was commanded
  double rms_A = 0;            // of the residuals
  double held_out_ratio = 0;   // rms on the half of the log that was held out, over that fitted
  double autocorrelation = 0;  // of residuals of windows that share no sample, lag 1
};

/// All in amperes of torque current: k_t itself does not show in a log.
struct BalanceFit {
  Estimate inertia_A_s2;  // J/k_t; per rad
  Estimate coulomb_A;
  Estimate viscous_A_s;               // B/k_t; per rad
  std::optional<Estimate> gravity_A;  // nothing: the output did not turn far enough
  std::optional<Estimate> gear_loss;  // (1/η − η)/2 over (1/η + η)/2
  double gravity_phase_rad = 0;       // of sin(θ_out + phase), from where the log began
  std::vector<Cogging> cogging;       // the strongest first
  double delay_s = 0;
  BalanceCheck check;
  std::vector<BalanceWindow> windows;
  Eigen::VectorXd coefficients;

  double expected_A(const BalanceWindow& window) const { return window.terms.dot(coefficients); }
};

/// Nothing where the drive hardly turned: fewer than kFewestWindows, which is one run of them for
/// each group of the jackknife.
std::optional<BalanceFit> fit_balance(const Track& track);
inline constexpr std::size_t kFewestWindows = 240;
/// With a commanded torque, to count as an experiment (assumed).
inline constexpr std::size_t kFewestCommanded = 100;
/// Gravity is looked for when the output has turned as far (assumed).
inline constexpr double kGravityTravel_rad = 1.0;

}  // namespace lk::emulator
