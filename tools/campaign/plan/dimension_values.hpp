#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "tools/campaign/results/case_result.hpp"

namespace lk::emulator {

/// How a drawn number is rounded, so that a person can type it: times to a millisecond, others to
/// four significant digits, counts to whole numbers.
enum class Rounding : std::uint8_t { kFigures, kMilliseconds, kWhole };

/// What a dimension may be: a list of words or numbers, or a range with a distribution.
class DimensionValues {
 public:
  /// A list; all of a kind. `weights` are empty (all alike) or one a value, ≥ 0, not all 0.
  static DimensionValues listed(std::vector<CaseValue> values, std::vector<double> weights = {});
  struct Range {
    double from = 0, to = 0;     // from < to
    bool log = false;            // evenly in the logarithm; from > 0
    std::optional<double> mean;  // with `sd`: normal, cut off at the ends
    double sd = 1;
    Rounding rounding = Rounding::kFigures;
  };
  static DimensionValues ranged(const Range& range);

  bool is_listed() const { return !values_.empty(); }
  bool has_words() const;
  /// Of a list.
  std::size_t size() const { return values_.size(); }
  const std::vector<CaseValue>& values() const { return values_; }
  double weight(std::size_t n) const { return weights_.empty() ? 1 : weights_[n]; }
  /// The value below which the share `u` of all draws lies, 0 ≤ u < 1. Of a list: the one whose
  /// turn it is.
  CaseValue quantile(double u) const;
  /// Where `value` lies, 0 to 1; the inverse of `quantile` where there is one.
  double place_of(const CaseValue& value) const;
  double least() const;  // of numbers
  double most() const;

 private:
  std::vector<CaseValue> values_;
  std::vector<double> weights_;
  Range range_;
};

}  // namespace lk::emulator
