#include "tools/campaign/plan/surrogate.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

namespace lk::emulator {
namespace {

// Assumed: how alike cases are that differ in a word, or in whether a dimension counts at all.
constexpr double kOtherWord = 0.25;
constexpr double kNoise = 1e-3;  // of the variance: what the dimensions do not tell

}  // namespace

Surrogate::Surrogate(std::vector<Place> places, const std::vector<double>& heights,
                     std::vector<bool> words)
    : places_(std::move(places)), words_(std::move(words)) {
  Eigen::VectorXd centred =
      Eigen::Map<const Eigen::VectorXd>(heights.data(), static_cast<Eigen::Index>(heights.size()));
  middle_ = centred.mean();
  centred.array() -= middle_;
  scale_ = std::max(std::sqrt(centred.squaredNorm() / static_cast<double>(heights.size())), 1e-6);
  centred /= scale_;
  double best = -std::numeric_limits<double>::infinity();
  double best_width = width_;
  for (const double width : {0.15, 0.3, 0.6, 1.2}) {
    const double likelihood = fit(width, centred);
    if (likelihood <= best) continue;
    best = likelihood;
    best_width = width;
  }
  fit(best_width, centred);
}

double Surrogate::likeness(const Place& a, const Place& b, double width) const {
  double squares = 0;
  double factor = 1;
  for (std::size_t d = 0; d < a.size(); ++d) {
    const bool none_a = std::isnan(a[d]);
    const bool none_b = std::isnan(b[d]);
    if (none_a || none_b || words_[d]) {
      if (none_a != none_b || (!none_a && a[d] != b[d])) factor *= kOtherWord;
    } else {
      squares += (a[d] - b[d]) * (a[d] - b[d]);
    }
  }
  return factor * std::exp(-squares / (2 * width * width));
}

double Surrogate::fit(double width, const Eigen::VectorXd& heights) {
  const auto size = static_cast<Eigen::Index>(places_.size());
  Eigen::MatrixXd covariance(size, size);
  for (Eigen::Index i = 0; i < size; ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) {
      covariance(i, j) = likeness(places_[static_cast<std::size_t>(i)],
                                  places_[static_cast<std::size_t>(j)], width);
    }
    covariance(i, i) += kNoise;
  }
  const Eigen::LLT<Eigen::MatrixXd> factor(covariance.selfadjointView<Eigen::Lower>());
  lower_ = factor.matrixL();
  weights_ = factor.solve(heights);
  width_ = width;
  return -0.5 * heights.dot(weights_) - lower_.diagonal().array().log().sum();
}

Surrogate::Guess Surrogate::at(const Place& place) const {
  Eigen::VectorXd likeness_to(static_cast<Eigen::Index>(places_.size()));
  for (std::size_t n = 0; n < places_.size(); ++n) {
    likeness_to(static_cast<Eigen::Index>(n)) = likeness(places_[n], place, width_);
  }
  const Eigen::VectorXd part = lower_.triangularView<Eigen::Lower>().solve(likeness_to);
  const double variance = std::max(1 + kNoise - part.squaredNorm(), 1e-9);
  return {middle_ + scale_ * likeness_to.dot(weights_), scale_ * std::sqrt(variance)};
}

}  // namespace lk::emulator
