#pragma once

/// @file What a campaign has to come to: --require "coverage>=0.99".

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tools/campaign/report/answer.hpp"

namespace lk::emulator {

struct Threshold {
  enum class Measure : std::uint8_t {
    kCoverage,       // 0 to 1
    kCoverageLower,  // the lower bound of its 95 % interval
    kOutcome,        // cases of one outcome
    kLatency,        // s, from the first effect to whoever noticed first
  };
  std::string text;  // as it was written
  Measure measure = Measure::kCoverage;
  CaseOutcome outcome = CaseOutcome::kLate;
  double share = 1;  // of a latency: 0.5, 0.99; 1 is the worst
  std::string kind;  // of fault; empty: all
  bool at_least = true;
  double limit = 0;
};

/// MEASURE[KIND]>=LIMIT or <=LIMIT, [KIND] or not: "coverage", "coverage.lower", an outcome
/// ("silently_wrong", "not_fired"), "latency.p50_s", "latency.p99_s", "latency.worst_s". Throws
/// StartError.
Threshold parse_threshold(std::string_view text);

struct ThresholdResult {
  std::string text;
  bool holds = false;
  /// Nothing: there is nothing to measure (no dangerous case, no detection), and it does not hold.
  std::optional<double> measured;
  std::uint64_t missing = 0;  // cases that have no result: it does not hold, whatever is measured
};
/// Throws StartError: a kind that the plan does not have, a bound of a campaign whose sampling is
/// not random.
std::vector<ThresholdResult> check_thresholds(const Answer& answer,
                                              const std::vector<Threshold>& thresholds);

/// "coverage>=0.99: measured 0.994565", and how many cases are missing.
std::string threshold_sentence(const ThresholdResult& result);

}  // namespace lk::emulator
