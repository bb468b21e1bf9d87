#include "tools/campaign/plan/dimension_values.hpp"

#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <cassert>
#include <charconv>
#include <cmath>
#include <numeric>
#include <utility>

namespace lk::emulator {
namespace {

double rounded_to(double value, Rounding rounding) {
  if (rounding == Rounding::kWhole) return std::round(value);
  if (rounding == Rounding::kMilliseconds) return std::round(value * 1e3) / 1e3;
  constexpr int kFigures = 4;
  char text[32];
  const auto end =
      std::to_chars(text, text + sizeof text, value, std::chars_format::scientific, kFigures - 1)
          .ptr;
  double result = value;
  std::from_chars(text, end, result);
  return result;
}

double number(const CaseValue& value) { return std::get<double>(value); }

}  // namespace

DimensionValues DimensionValues::listed(std::vector<CaseValue> values,
                                        std::vector<double> weights) {
  assert(!values.empty() && (weights.empty() || weights.size() == values.size()));
  DimensionValues set;
  set.values_ = std::move(values);
  set.weights_ = std::move(weights);
  return set;
}

DimensionValues DimensionValues::ranged(const Range& range) {
  assert(range.from < range.to && (!range.log || range.from > 0));
  DimensionValues set;
  set.range_ = range;
  return set;
}

bool DimensionValues::has_words() const {
  return is_listed() && std::holds_alternative<std::string>(values_.front());
}

CaseValue DimensionValues::quantile(double u) const {
  if (is_listed()) {
    if (weights_.empty()) {
      return values_[std::min(static_cast<std::size_t>(u * static_cast<double>(size())),
                              size() - 1)];
    }
    double left = u * std::accumulate(weights_.begin(), weights_.end(), 0.0);
    for (std::size_t n = 0; n + 1 < size(); ++n) {
      if (left < weights_[n]) return values_[n];
      left -= weights_[n];
    }
    return values_.back();
  }
  const auto& [from, to, log, mean, sd, rounding] = range_;
  double value = from + (to - from) * u;
  if (log) {
    value = from * std::pow(to / from, u);
  } else if (mean) {
    const boost::math::normal normal(*mean, sd);
    const double below = cdf(normal, from);
    const double share = below + (cdf(normal, to) - below) * u;
    // Beyond what the distribution can tell, the nearer end.
    value = share <= 0 ? from : share >= 1 ? to : boost::math::quantile(normal, share);
  }
  return std::clamp(rounded_to(value, rounding), from, to);
}

double DimensionValues::place_of(const CaseValue& value) const {
  if (is_listed()) {
    double below = 0;
    double all = 0;
    for (std::size_t n = 0; n < size(); ++n) {
      if (values_[n] == value) below = all + weight(n) / 2;
      all += weight(n);
    }
    return below / all;
  }
  const auto& [from, to, log, mean, sd, rounding] = range_;
  if (log) return std::log(number(value) / from) / std::log(to / from);
  if (mean) {
    const boost::math::normal normal(*mean, sd);
    const double below = cdf(normal, from);
    return (cdf(normal, number(value)) - below) / (cdf(normal, to) - below);
  }
  return (number(value) - from) / (to - from);
}

double DimensionValues::least() const {
  if (!is_listed()) return range_.from;
  return number(*std::ranges::min_element(values_, {}, number));
}

double DimensionValues::most() const {
  if (!is_listed()) return range_.to;
  return number(*std::ranges::max_element(values_, {}, number));
}

}  // namespace lk::emulator
