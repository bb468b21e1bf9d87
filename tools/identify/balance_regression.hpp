#pragma once

/// @file Weighted least squares over the windows of a balance of torques, and how sure what comes
/// of them is.

#include <Eigen/Dense>
#include <cmath>
#include <utility>
#include <vector>

#include "tools/identify/estimate.hpp"
#include "tools/identify/torque_balance.hpp"

namespace lk::emulator {

/// The jackknife's groups, each of every 24th run of ten windows: windows that overlap stay
/// together, and every group has something of each part of the log.
inline constexpr std::size_t kGroups = 24;
inline constexpr std::size_t kRunOfWindows = 10;
inline constexpr double kStudent = 2.069;  // 95 % of Student's t with kGroups − 1 degrees

/// Weights of the windows, 1/A²: those with a commanded current are better known than measured
/// ones, and these the less the faster it changed between its samples: with the acceleration.
struct Weights {
  double commanded = 1;
  double measured_A2 = 1;        // variance of a measured one at steady speed
  double per_acceleration2 = 0;  // and how that grows with its square

  double of(const BalanceWindow& window) const;
};

inline double residual_A(const BalanceWindow& window, const Eigen::VectorXd& coefficients) {
  return window.iq_A - window.terms.dot(coefficients);
}

/// Fits, weighs by what is left, and fits again. Windows whose command is not the one that the
/// drive had, because a line of the log is lost, are left out: by what is left of them. Of measured
/// currents none is: what is far off there is often what tells the inertia.
class Regression {
 public:
  /// `windows` are at least one, and outlive this. `used`: the places of the terms that are looked
  /// for; the coefficients of the others are 0.
  Regression(const std::vector<BalanceWindow>& windows, std::vector<Eigen::Index> used);

  const Eigen::VectorXd& coefficients() const { return coefficients_; }
  const Weights& weights() const { return weights_; }
  bool kept(std::size_t window) const { return kept_[window]; }
  /// The coefficients without each group.
  std::vector<Eigen::VectorXd> jackknife() const;

  /// What a function of the coefficients is, and how well it is known. `without`: of jackknife().
  template <class Function>
  Estimate estimate(const std::vector<Eigen::VectorXd>& without, Function of) const {
    double mean = 0;
    for (const auto& one : without) mean += of(one) / kGroups;
    double squares = 0;
    for (const auto& one : without) squares += std::pow(of(one) - mean, 2);
    return {of(coefficients_), kStudent * std::sqrt(squares * (kGroups - 1) / kGroups)};
  }

 private:
  void fit();
  void weigh();
  void weigh_measured(std::vector<std::pair<double, double>>& measured);
  void trim();

  const std::vector<BalanceWindow>& windows_;
  std::vector<Eigen::Index> used_;
  std::vector<bool> kept_;
  Weights weights_;
  Eigen::VectorXd coefficients_;
};

}  // namespace lk::emulator
