#pragma once

/// @file The balance of torques at the rotor, in amperes of torque current: what the drive gave is
/// what inertia, friction, cogging and gravity took. Averaged over windows with a triangle of
/// weights, so that the acceleration is a difference of two mean speeds of the encoder:
///
///   ⟨iq⟩ = J/k_t·⟨ω̇⟩ + i_c·⟨s(ω)⟩ + B/k_t·⟨ω⟩ + i_0 + Σ cogging + gravity
///
/// with s(ω) = sign ω·(1 + (τ_s/τ_c − 1)/(1 + (ω/ω_s)²)), the friction of docs/model.md §4.

#include <Eigen/Dense>
#include <vector>

#include "tools/identify/track.hpp"

namespace lk::emulator {

/// One window: what the drive gave, and what took it.
struct BalanceWindow {
  double time_s = 0;
  double angle_rad = 0;  // in its middle
  double speed_rad_s = 0;
  double iq_A = 0;
  bool commanded = false;  // iq is what was commanded, not what was measured
  Eigen::VectorXd terms;   // in the order of BalanceTerm, then two for each order of cogging
  std::size_t first = 0, middle = 0, last = 0;  // samples
};

enum class BalanceTerm : std::uint8_t {
  kInertia,   // rad/s²
  kCoulomb,   // s(ω)
  kViscous,   // rad/s
  kConstant,  // 1
  kGravitySin,
  kGravityCos,
  kGearLoss,  // what a gear takes of gravity: sign ω·|sin(θ_out + phase)|
  // The same as kCoulomb and kViscous where the torque was commanded, else 0: in pulses of torque
  // the play of a gear lets rotor and output go apart, and friction with them.
  kPulseCoulomb,
  kPulseViscous,
};
inline constexpr int kFixedTerms = 9;

/// Half of a window (assumed): as long as the shortest pulse of a plan, at least one sample.
inline constexpr double kHalfWindow_s = 0.010;
/// Windows in which the rotor was slower or turned round are left out: there friction is what is
/// needed, not what it is (assumed).
inline constexpr double kSlowest_rad_s = 1;

/// What the balance is made with.
struct BalanceShape {
  std::vector<int> orders;  // of cogging, per turn of the rotor
  double delay_s = 0;       // how much later than its stamp a command acts, seen from the samples
  double gravity_phase_rad = 0;
};
std::vector<BalanceWindow> balance_windows(const Track& track, const BalanceShape& shape);

/// e^(jnθ) averaged over every `every`-th window of the track, for n = 1 … `highest`: rows are
/// windows.
Eigen::MatrixXcd order_averages(const Track& track, const std::vector<BalanceWindow>& windows,
                                std::size_t every, int highest);

}  // namespace lk::emulator
