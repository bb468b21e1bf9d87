#include "tools/campaign/plan/adaptive.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "emulator/core/faults/fault_table.hpp"
#include "emulator/core/seed.hpp"
#include "tools/campaign/plan/sampling.hpp"

namespace lk::emulator {
namespace {

// All assumed; docs/campaigns.md shows what comes of them.
constexpr double kBredShare = 0.75;  // of a generation, while that gets nearer
constexpr double kBredShareElse = 0.0625;
constexpr std::size_t kCredit = 4;   // generations
constexpr double kNearer = 0.02;     // by this share of the distance, or more
constexpr std::size_t kParents = 8;  // the nearest cases
constexpr double kNoMargin = 1;

/// How far a case stood from failing; nothing: it says nothing.
std::optional<double> distance_of(const CaseResult& result) {
  if (result.outcome == CaseOutcome::kNotFired) return std::nullopt;
  if (result.outcome >= CaseOutcome::kLate) return 0;
  return std::max(result.margin.value_or(kNoMargin), 1e-6);
}

}  // namespace

class AdaptiveSampler::Random {
 public:
  Random(std::uint64_t seed, std::uint64_t generation) : state_(mix(mix(seed) + generation)) {}
  double share() { return uniform(mix(state_ += 0x9E3779B97F4A7C15U)); }
  std::size_t below(std::size_t count) {
    return std::min(static_cast<std::size_t>(share() * static_cast<double>(count)), count - 1);
  }
  /// Box and Muller (1958).
  double normal() {
    return std::sqrt(-2 * std::log(1 - share())) * std::cos(6.283185307179586 * share());
  }

 private:
  std::uint64_t state_;
};

std::size_t AdaptiveSampler::bred_count() const {
  if (tried_.size() < kParents) return 0;
  const double share = credit_ > 0 ? kBredShare : kBredShareElse;
  return static_cast<std::size_t>(share * kGeneration);
}

std::vector<CaseValues> AdaptiveSampler::next() {
  Random random(plan_.head.seed, generation_);
  const std::size_t bred_ones = bred_count();
  running_.clear();
  running_bred_ = kGeneration - bred_ones;
  for (std::size_t n = 0; n < kGeneration; ++n) {
    std::optional<CaseValues> values;
    if (n >= running_bred_) values = bred(random);
    // Drawn as `random` draws the case of this number.
    running_.push_back(values ? *values : random_values(plan_, generation_ * kGeneration + n));
  }
  ++generation_;
  return running_;
}

void AdaptiveSampler::learn(const std::vector<CaseResult>& results) {
  const double best_before =
      tried_.empty() ? std::numeric_limits<double>::infinity() : tried_.front().distance;
  for (std::size_t n = 0; n < std::min(results.size(), running_.size()); ++n) {
    const auto distance = distance_of(results[n]);
    if (!distance) continue;
    Tried tried{running_[n], {}, *distance, n >= running_bred_};
    for (std::size_t d = 0; d < tried.values.size(); ++d) {
      tried.place.push_back(tried.values[d] ? plan_.dimensions[d].values.place_of(*tried.values[d])
                                            : std::numeric_limits<double>::quiet_NaN());
    }
    tried_.push_back(std::move(tried));
  }
  std::ranges::stable_sort(tried_, {}, &Tried::distance);
  judge_generation(best_before);
  constexpr std::size_t kKept = 256;
  if (tried_.size() > kKept) tried_.resize(kKept);
}

/// Breeding goes on for as long as something gets nearer to failing; when nothing does, the space
/// is searched evenly, until a drawn case is nearer than all before.
void AdaptiveSampler::judge_generation(double best_before) {
  const bool nearer = !tried_.empty() && tried_.front().distance > 0 &&
                      tried_.front().distance < best_before * (1 - kNearer);
  if (nearer) {
    credit_ = kCredit;
  } else if (credit_ > 0) {
    --credit_;
  }
}

std::optional<CaseValues> AdaptiveSampler::bred(Random& random) const {
  constexpr int kAttempts = 20;
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    // The nearer, the likelier.
    const double share = random.share();
    const auto rank = static_cast<std::size_t>(share * share * kParents);
    const Tried& parent = tried_[std::min(rank, tried_.size() - 1)];
    const CaseValues values =
        values_at(random.share() < 0.5 ? mutated(parent, random) : crossed(parent, random));
    if (!is_excluded(plan_, values)) return values;
  }
  return std::nullopt;
}

/// Some of its dimensions a little or a lot elsewhere.
std::vector<double> AdaptiveSampler::mutated(const Tried& parent, Random& random) const {
  std::vector<double> place = parent.place;
  const double width = std::pow(10, -0.3 - 1.7 * random.share());
  const std::size_t sure = random.below(place.size());
  for (std::size_t d = 0; d < place.size(); ++d) {
    const bool words = plan_.dimensions[d].values.has_words();
    const double likely = words ? 0.1 : 0.5;
    if (std::isnan(place[d]) || (d != sure && random.share() > likely)) continue;
    place[d] = words ? random.share() : place[d] + width * random.normal();
  }
  return place;
}

/// On along the line from one of the nearest to another (differential evolution, Storn and Price
/// 1997).
std::vector<double> AdaptiveSampler::crossed(const Tried& parent, Random& random) const {
  const std::size_t pool = std::min(tried_.size(), 2 * kParents);
  const Tried& from = tried_[random.below(pool)];
  const Tried& to = tried_[random.below(pool)];
  const double factor = 0.3 + 0.9 * random.share();
  std::vector<double> place = parent.place;
  for (std::size_t d = 0; d < place.size(); ++d) {
    if (plan_.dimensions[d].values.has_words()) continue;
    const double step = factor * (to.place[d] - from.place[d]);
    if (std::isfinite(step) && std::isfinite(place[d])) place[d] += step;
  }
  return place;
}

CaseValues AdaptiveSampler::values_at(const std::vector<double>& place) const {
  const auto value_of = [&](std::size_t d) {
    double share = std::isnan(place[d]) ? 0.5 : std::abs(place[d]);
    share = std::fmod(share, 2.0);
    if (share > 1) share = 2 - share;  // reflected at both ends
    return plan_.dimensions[d].values.quantile(std::min(share, std::nextafter(1.0, 0.0)));
  };
  return values_by_kind(plan_, value_of);
}

}  // namespace lk::emulator
