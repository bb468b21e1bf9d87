#include "tools/campaign/report/statistics.hpp"

#include <boost/math/special_functions/beta.hpp>
#include <cmath>

namespace lk::emulator {
namespace {

constexpr double kTail = (1 - kConfidence) / 2;
// More trials than anybody makes; the bound is not looked for beyond.
constexpr double kMostTrials = 1e15;

/// Of counts that need not be whole: the lower bound is a quantile of a beta distribution.
double lower_bound(double hits, double misses) {
  return hits > 0 ? boost::math::ibeta_inv(hits, misses + 1, kTail) : 0;
}

/// The fewest trials, from `trials` on, whose lower bound reaches the claim; `bound` grows with
/// them. 0: not even kMostTrials do.
template <typename Bound>
std::uint64_t fewest(double trials, double claim, Bound bound) {
  double low = trials;
  double high = std::fmax(trials, 1);
  while (bound(high) < claim) {
    low = high;
    high *= 2;
    if (high > kMostTrials) return 0;
  }
  while (high - low > 1) {
    const double middle = std::floor((low + high) / 2);
    (bound(middle) < claim ? low : high) = middle;
  }
  return static_cast<std::uint64_t>(high);
}

}  // namespace

Interval clopper_pearson(std::uint64_t hits, std::uint64_t trials) {
  const auto k = static_cast<double>(hits);
  const auto misses = static_cast<double>(trials - hits);
  return {lower_bound(k, misses), 1 - lower_bound(misses, k)};
}

ClaimNeed claim_need(std::uint64_t hits, std::uint64_t trials, double claim) {
  ClaimNeed need;
  need.claim = claim;
  const auto n = static_cast<double>(trials);
  const auto misses = static_cast<double>(trials - hits);
  need.met = lower_bound(static_cast<double>(hits), misses) >= claim;
  if (need.met) {
    need.at_this_share = 0;
    return need;
  }
  need.all_hits =
      fewest(n, claim, [&](double all) { return lower_bound(all - misses, misses); }) - trials;
  const double share = trials > 0 ? static_cast<double>(hits) / n : 0;
  if (share <= claim) return need;
  const std::uint64_t at_this_share =
      fewest(n, claim, [&](double all) { return lower_bound(all * share, all * (1 - share)); });
  if (at_this_share > 0) need.at_this_share = at_this_share - trials;
  return need;
}

}  // namespace lk::emulator
