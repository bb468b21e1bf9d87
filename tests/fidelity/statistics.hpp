#pragma once

/// @file Statistics of logs, for real and emulated drives.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <numeric>
#include <vector>

namespace lk::test {

inline double mean(const std::vector<double>& x) {
  return std::accumulate(x.begin(), x.end(), 0.0) / static_cast<double>(x.size());
}

inline double deviation(const std::vector<double>& x) {
  const double m = mean(x);
  double sum = 0;
  for (const double v : x) sum += (v - m) * (v - m);
  return std::sqrt(sum / static_cast<double>(x.size()));
}

/// Returns the standard deviation from one sample to the next, which excludes slow drift of an
/// integrator within the friction.
inline double noise(const std::vector<double>& x) {
  double sum = 0;
  for (std::size_t n = 1; n < x.size(); ++n) sum += (x[n] - x[n - 1]) * (x[n] - x[n - 1]) / 2;
  return std::sqrt(sum / static_cast<double>(x.size() - 1));
}

/// Returns a value from −1 to 1, with the sample `lag` before.
inline double autocorrelation(const std::vector<double>& x, std::size_t lag = 1) {
  const double m = mean(x);
  double sum = 0;
  for (std::size_t n = lag; n < x.size(); ++n) sum += (x[n] - m) * (x[n - lag] - m);
  return sum / (static_cast<double>(x.size()) * deviation(x) * deviation(x));
}

/// Returns dy/dx of the regression line through the samples.
inline double slope(const std::vector<double>& x, const std::vector<double>& y) {
  double sum = 0;
  for (std::size_t n = 0; n < x.size(); ++n) sum += (x[n] - mean(x)) * (y[n] - mean(y));
  return sum / (static_cast<double>(x.size()) * deviation(x) * deviation(x));
}

/// Returns a quantile of values in any order; `share` from 0, the least, to 1, the largest.
inline double quantile(std::vector<double> x, double share) {
  std::sort(x.begin(), x.end());
  const double place = share * static_cast<double>(x.size() - 1);
  const auto below = static_cast<std::size_t>(place);
  const double part = place - static_cast<double>(below);
  return part > 0 ? x[below] + part * (x[below + 1] - x[below]) : x[below];
}

/// Returns the share of the variance of y, 0 to 1, that a sine with `order` periods per turn
/// explains. This is the least-squares spectrum, which allows uneven sampling.
inline double spectral_share(const std::vector<double>& turns, const std::vector<double>& y,
                             double order) {
  const double m = mean(y);
  double ss = 0, cc = 0, sc = 0, ys = 0, yc = 0, yy = 0;
  for (std::size_t n = 0; n < y.size(); ++n) {
    const double angle = 2 * std::numbers::pi * order * turns[n];
    const double s = std::sin(angle);
    const double c = std::cos(angle);
    ss += s * s, cc += c * c, sc += s * c;
    ys += (y[n] - m) * s, yc += (y[n] - m) * c, yy += (y[n] - m) * (y[n] - m);
  }
  const double det = ss * cc - sc * sc;
  return (ys * ys * cc - 2 * ys * yc * sc + yc * yc * ss) / (det * yy);
}

/// Returns the order from `low` to `high` with the largest share.
inline double spectral_peak(const std::vector<double>& turns, const std::vector<double>& y,
                            double low, double high) {
  double best = low;
  double most = -1;
  for (double order = low; order <= high; order += 0.05) {
    const double share = spectral_share(turns, y, order);
    if (share > most) most = share, best = order;
  }
  return best;
}

struct Band {
  double low = 0, high = 0;
};

/// Returns the range with 99 of 100 means of `count` values drawn from `values` at random
/// (bootstrap). Deterministic.
inline Band bootstrap_band(const std::vector<double>& values, std::size_t count) {
  std::uint64_t dice = 88172645463325252U;
  const auto draw = [&] {
    dice ^= dice << 13U;
    dice ^= dice >> 7U;
    dice ^= dice << 17U;
    return values[dice % values.size()];
  };
  std::vector<double> means;
  for (int n = 0; n < 4000; ++n) {
    double sum = 0;
    for (std::size_t k = 0; k < count; ++k) sum += draw();
    means.push_back(sum / static_cast<double>(count));
  }
  return {quantile(means, 0.005), quantile(means, 0.995)};
}

}  // namespace lk::test
