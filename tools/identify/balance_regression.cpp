#include "tools/identify/balance_regression.hpp"

#include <algorithm>

namespace lk::emulator {
namespace {

/// Of measured windows: fewer have no variance worth speaking of.
constexpr std::size_t kFewestMeasured = 20;

std::size_t group_of(std::size_t window) { return window / kRunOfWindows % kGroups; }

double acceleration(const BalanceWindow& window) {
  return window.terms(static_cast<Eigen::Index>(BalanceTerm::kInertia));
}

/// Sums of a least-squares problem.
struct Sums {
  Eigen::MatrixXd normal;
  Eigen::VectorXd right;

  explicit Sums(Eigen::Index terms)
      : normal(Eigen::MatrixXd::Zero(terms, terms)), right(Eigen::VectorXd::Zero(terms)) {}
  void add(const BalanceWindow& window, double weight) {
    normal.selfadjointView<Eigen::Lower>().rankUpdate(window.terms, weight);
    right += weight * window.iq_A * window.terms;
  }
  /// Of the terms that are `used`; 0 for the others.
  Eigen::VectorXd solve(const std::vector<Eigen::Index>& used) const {
    const auto count = static_cast<Eigen::Index>(used.size());
    Eigen::MatrixXd a(count, count);
    Eigen::VectorXd b(count);
    for (Eigen::Index i = 0; i < count; ++i) {
      b(i) = right(used[static_cast<std::size_t>(i)]);
      for (Eigen::Index k = 0; k < count; ++k) {
        const Eigen::Index row = used[static_cast<std::size_t>(i)];
        const Eigen::Index column = used[static_cast<std::size_t>(k)];
        a(i, k) = normal(std::max(row, column), std::min(row, column));
      }
    }
    // Terms have units: each is scaled to 1 before it is solved.
    const Eigen::VectorXd scale = a.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    const Eigen::MatrixXd scaled = scale.asDiagonal() * a * scale.asDiagonal();
    const Eigen::VectorXd found =
        scaled.completeOrthogonalDecomposition().solve(scale.cwiseProduct(b)).cwiseProduct(scale);
    Eigen::VectorXd all = Eigen::VectorXd::Zero(right.size());
    for (Eigen::Index i = 0; i < count; ++i) all(used[static_cast<std::size_t>(i)]) = found(i);
    return all;
  }
};

}  // namespace

double Weights::of(const BalanceWindow& window) const {
  if (window.commanded) return commanded;
  return 1 / (measured_A2 + per_acceleration2 * std::pow(acceleration(window), 2));
}

Regression::Regression(const std::vector<BalanceWindow>& windows, std::vector<Eigen::Index> used)
    : windows_(windows), used_(std::move(used)), kept_(windows.size(), true) {
  for (int round = 0; round < 6; ++round) {
    fit();
    weigh();
    if (round > 0) trim();
  }
  fit();
}

std::vector<Eigen::VectorXd> Regression::jackknife() const {
  const Eigen::Index terms = windows_.front().terms.size();
  std::vector<Sums> groups(kGroups, Sums(terms));
  for (std::size_t n = 0; n < windows_.size(); ++n) {
    if (kept_[n]) groups[group_of(n)].add(windows_[n], weights_.of(windows_[n]));
  }
  Sums whole(terms);
  for (const Sums& group : groups) {
    whole.normal += group.normal;
    whole.right += group.right;
  }
  std::vector<Eigen::VectorXd> without;
  for (Sums& group : groups) {
    group.normal = whole.normal - group.normal;
    group.right = whole.right - group.right;
    without.push_back(group.solve(used_));
  }
  return without;
}

void Regression::fit() {
  Sums whole(windows_.front().terms.size());
  for (std::size_t n = 0; n < windows_.size(); ++n) {
    if (kept_[n]) whole.add(windows_[n], weights_.of(windows_[n]));
  }
  coefficients_ = whole.solve(used_);
}

void Regression::weigh() {
  double squares = 0;
  double count = 0;
  std::vector<std::pair<double, double>> measured;  // acceleration², what is left²
  for (std::size_t n = 0; n < windows_.size(); ++n) {
    if (!kept_[n]) continue;
    const double left = std::pow(residual_A(windows_[n], coefficients_), 2);
    if (!windows_[n].commanded) {
      measured.emplace_back(std::pow(acceleration(windows_[n]), 2), left);
      continue;
    }
    squares += left;
    count += 1;
  }
  if (squares > 0) weights_.commanded = count / squares;
  if (measured.size() > kFewestMeasured) weigh_measured(measured);
}

/// The quieter half has the variance of steady speed, the other one the rest.
void Regression::weigh_measured(std::vector<std::pair<double, double>>& measured) {
  const auto half = measured.size() / 2;
  std::ranges::nth_element(measured, measured.begin() + static_cast<std::ptrdiff_t>(half));
  double steady = 0;
  for (std::size_t n = 0; n < half; ++n) steady += measured[n].second;
  double more = 0;
  double accelerations = 0;
  weights_.measured_A2 = std::max(steady / static_cast<double>(half), 1e-12);
  for (std::size_t n = half; n < measured.size(); ++n) {
    more += measured[n].second - weights_.measured_A2;
    accelerations += measured[n].first;
  }
  weights_.per_acceleration2 = accelerations > 0 ? std::max(more / accelerations, 0.0) : 0.0;
}

/// Beyond five standard deviations, as the median of what is left has them.
void Regression::trim() {
  std::vector<double> left;
  for (const BalanceWindow& w : windows_) {
    if (w.commanded) left.push_back(std::abs(residual_A(w, coefficients_)));
  }
  if (left.empty()) return;
  const auto middle = left.begin() + static_cast<std::ptrdiff_t>(left.size() / 2);
  std::ranges::nth_element(left, middle);
  constexpr double kDeviationOfMedian = 1.4826;
  const double most_A = 5 * kDeviationOfMedian * *middle;
  for (std::size_t n = 0; n < windows_.size(); ++n) {
    const BalanceWindow& w = windows_[n];
    kept_[n] = !w.commanded || std::abs(residual_A(w, coefficients_)) <= most_A;
  }
}

}  // namespace lk::emulator
