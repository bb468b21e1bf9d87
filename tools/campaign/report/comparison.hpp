#pragma once

/// @file Two campaigns of the same plan, case by case.

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "tools/campaign/report/answer.hpp"

namespace lk::emulator {

struct WorseCase {
  CaseOutcome before = CaseOutcome::kNotFired;
  CaseResult now;
};

/// A case is worse when its outcome comes later in CaseOutcome than before, and better when it
/// comes earlier; cases that did not fire, before or now, are neither.
struct Comparison {
  /// Cases that are kept; of the others there is the count.
  static constexpr std::size_t kMostWorse = 25'000;

  CampaignHead before;
  CampaignHead now;
  std::array<OutcomeCounts, kCaseOutcomes> moves{};  // [before][now]
  std::uint64_t worse = 0;
  std::uint64_t better = 0;
  std::uint64_t same = 0;         // outcome
  std::uint64_t not_fired = 0;    // with another outcome before or now: neither
  std::uint64_t only_before = 0;  // have no result now
  std::uint64_t only_now = 0;     // had none
  std::vector<WorseCase> cases;   // worse ones, by number
  std::uint64_t cases_left_out = 0;

  bool is_worse() const { return worse > 0; }
};

/// Gives one result after the other, by ascending number; null after the last. Each stands until
/// the next is asked for.
using CaseSource = std::function<const CaseResult*()>;

/// The same number has to mean the same case: throws StartError where sampling, seed, numbers,
/// dimensions or the values of a case differ, and for `adaptive`, whose cases depend on results.
Comparison compare_campaigns(const CampaignHead& before, const CaseSource& next_before,
                             const CampaignHead& now, const CaseSource& next_now);

}  // namespace lk::emulator
