#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace lk::emulator {

/// Where a case lies: of each dimension a share from 0 to 1, of words the number of the word; NaN
/// where the dimension does not count.
using Place = std::vector<double>;

/// What is likely between cases that have been run: a Gaussian process (Rasmussen, Williams 2006,
/// algorithm 2.1), whose width is the likeliest of a few.
class Surrogate {
 public:
  /// `words`: which dimensions are words. At least one place; as many heights.
  Surrogate(std::vector<Place> places, const std::vector<double>& heights, std::vector<bool> words);

  struct Guess {
    double mean = 0;
    double deviation = 0;
  };
  Guess at(const Place& place) const;

 private:
  double likeness(const Place& a, const Place& b, double width) const;
  /// Returns the logarithm of the likelihood, up to what all widths share.
  double fit(double width, const Eigen::VectorXd& heights);

  std::vector<Place> places_;
  std::vector<bool> words_;
  double width_ = 0.3;
  double middle_ = 0, scale_ = 1;
  Eigen::MatrixXd lower_;  // Cholesky factor of the covariance
  Eigen::VectorXd weights_;
};

}  // namespace lk::emulator
