#pragma once

/// @file What so many cases of so many say about a share.

#include <cstdint>
#include <optional>

namespace lk::emulator {

/// Of the intervals: 95 %, a fortieth on either side.
inline constexpr double kConfidence = 0.95;

struct Interval {
  double lower = 0;
  double upper = 1;
};

/// C. J. Clopper, E. S. Pearson, "The use of confidence or fiducial limits illustrated in the case
/// of the binomial" (1934): the exact interval of a share of which `hits` of `trials` are known.
/// 0 to 1 where nothing has been tried. `hits` are at most `trials`.
Interval clopper_pearson(std::uint64_t hits, std::uint64_t trials);

/// What it takes until the lower bound of the interval reaches a claim.
struct ClaimNeed {
  double claim = 0;  // 0.9
  bool met = false;
  /// Further trials, if all of them are hits; 0 where it is met.
  std::uint64_t all_hits = 0;
  /// Further trials, if the share stays as it is. Nothing: it is not above the claim, and no number
  /// helps; or nothing has been tried.
  std::optional<std::uint64_t> at_this_share;
};
/// `claim` is above 0 and below 1.
ClaimNeed claim_need(std::uint64_t hits, std::uint64_t trials, double claim);

}  // namespace lk::emulator
