#include "tools/campaign/plan/adaptive.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "emulator/core/seed.hpp"
#include "tools/campaign/plan/sampling.hpp"

namespace lk::emulator {
namespace {

// All assumed; docs/campaigns.md shows what comes of them.
constexpr std::size_t kCredit = 4;       // generations
constexpr std::size_t kFirstCredit = 2;  // the same, of a kind of fault that is new
constexpr double kNearer = 0.02;         // by this share of a usual distance, or more
constexpr std::size_t kLearnt = 160;     // cases that the surrogate knows: the nearest
constexpr int kCandidates = 400;         // for each that is run
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

AdaptiveSampler::AdaptiveSampler(const Plan& plan)
    : plan_(plan),
      niches_{{std::nullopt, std::numeric_limits<double>::infinity(), kCredit, false}} {
  for (const Dimension& dimension : plan.dimensions) {
    if (dimension.target == Target::kFaultKind) kind_ = words_.size();
    words_.push_back(dimension.values.has_words());
  }
}

std::vector<CaseValues> AdaptiveSampler::next() {
  Random random(plan_.head.seed, generation_);
  const std::uint64_t first = generation_ * kGeneration;
  running_ = hopeful(turns(), random);
  // Drawn as `random` draws the case of this number.
  while (running_.size() < kGeneration) {
    running_.push_back(random_values(plan_, first + running_.size()));
  }
  ++generation_;
  return running_;
}

bool AdaptiveSampler::is_of(const Place& place, const Niche& niche) const {
  return !niche.place || place[*kind_] == *niche.place;
}

std::vector<const AdaptiveSampler::Niche*> AdaptiveSampler::turns() {
  std::vector<const Niche*> turns;
  if (tried_.size() < kGeneration / 2) return turns;
  std::vector<Niche*> open;
  for (Niche& niche : niches_) {
    niche.used = false;
    if (niche.credit > 0) open.push_back(&niche);
  }
  if (open.empty()) return turns;
  // Most for all cases, as long as that gets nearer; each kind of fault has its turn now and then.
  const bool all = open.front() == niches_.data();
  for (std::size_t n = 0; n < kGeneration - 1; ++n) {
    const bool of_kind = !all || n % 3 == 2;
    const std::size_t kinds = open.size() - (all ? 1 : 0);
    Niche* const niche =
        of_kind && kinds > 0 ? open[(all ? 1 : 0) + (generation_ * 2 + n) % kinds] : open.front();
    niche->used = true;
    turns.push_back(niche);
  }
  return turns;
}

/// Hope goes on for as long as something gets nearer to failing; when nothing does, the space is
/// searched evenly, until a case that was drawn is nearer than all of its niche before.
void AdaptiveSampler::learn(const std::vector<CaseResult>& results) {
  std::vector<Niche> before = niches_;
  for (std::size_t n = 0; n < std::min(results.size(), running_.size()); ++n) {
    const auto distance = distance_of(results[n]);
    if (!distance) continue;
    tried_.push_back({place_of(running_[n]), *distance});
    const Place& place = tried_.back().place;
    const bool known = std::ranges::any_of(
        niches_, [&](const Niche& niche) { return niche.place && is_of(place, niche); });
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    if (!known && kind_) niches_.push_back({place[*kind_], kInfinity, kFirstCredit, false});
    for (Niche& niche : niches_) {
      if (is_of(place, niche)) niche.best = std::min(niche.best, *distance);
    }
  }
  std::ranges::stable_sort(tried_, {}, &Tried::distance);
  if (tried_.size() > kLearnt) tried_.resize(kLearnt);
  const double usual = tried_.empty() ? 1 : tried_[tried_.size() / 2].distance;
  for (std::size_t n = 0; n < before.size(); ++n) {
    Niche& niche = niches_[n];
    const bool nearer = niche.best > 0 && niche.best < before[n].best - kNearer * usual;
    if (nearer) {
      niche.credit = kCredit;
    } else if (niche.used && niche.credit > 0) {
      --niche.credit;
    }
  }
}

Place AdaptiveSampler::place_of(const CaseValues& values) const {
  Place place;
  for (std::size_t d = 0; d < values.size(); ++d) {
    place.push_back(values[d] ? plan_.dimensions[d].values.place_of(*values[d])
                              : std::numeric_limits<double>::quiet_NaN());
  }
  return place;
}

CaseValues AdaptiveSampler::values_at(const Place& place) const {
  return values_by_kind(plan_, [&](std::size_t d) {
    const double share = std::isnan(place[d]) ? 0.5 : std::clamp(place[d], 0.0, 1.0);
    return plan_.dimensions[d].values.quantile(std::min(share, std::nextafter(1.0, 0.0)));
  });
}

/// Somewhere in the niche, or not far from one of its nearest.
Place AdaptiveSampler::candidate(const Niche& niche, Random& random) const {
  constexpr std::size_t kParents = 5;
  std::vector<const Place*> parents;
  for (const Tried& tried : tried_) {
    if (is_of(tried.place, niche)) parents.push_back(&tried.place);
    if (parents.size() == kParents) break;
  }
  Place place;
  if (!parents.empty() && random.share() < 0.6) {
    place = mutated(*parents[random.below(parents.size())], random);
  } else {
    for (std::size_t d = 0; d < plan_.dimensions.size(); ++d) place.push_back(random.share());
  }
  if (niche.place) place[*kind_] = *niche.place;
  return place;
}

/// Some dimensions a little or a lot elsewhere, now and then at an end: what is worst often is.
Place AdaptiveSampler::mutated(const Place& parent, Random& random) const {
  Place place = parent;
  const double width = std::pow(10, -0.3 - 1.4 * random.share());
  const std::size_t sure = random.below(place.size());
  for (std::size_t d = 0; d < place.size(); ++d) {
    const double likely = words_[d] ? 0.1 : 0.5;
    if (std::isnan(place[d]) || (d != sure && random.share() > likely)) continue;
    if (words_[d]) {
      place[d] = random.share();
    } else if (random.share() < 0.15) {
      place[d] = random.share() < 0.5 ? 0 : 1;
    } else {
      place[d] = std::clamp(place[d] + width * random.normal(), 0.0, 1.0);
    }
  }
  return place;
}

std::vector<CaseValues> AdaptiveSampler::hopeful(const std::vector<const Niche*>& niches,
                                                 Random& random) const {
  std::vector<Place> places;
  std::vector<double> heights;
  for (const Tried& tried : tried_) {
    places.push_back(tried.place);
    heights.push_back(tried.distance);
  }
  std::vector<CaseValues> chosen;
  for (const Niche* niche : niches) {
    const Surrogate surrogate(places, heights, words_);
    // Some of a generation trust what is known, some try where least is.
    const double courage =
        0.3 + 2.0 * static_cast<double>(chosen.size()) / static_cast<double>(niches.size());
    std::optional<CaseValues> best;
    double lowest = std::numeric_limits<double>::infinity();
    for (int k = 0; k < kCandidates; ++k) {
      CaseValues values = values_at(candidate(*niche, random));
      const Surrogate::Guess guess = surrogate.at(place_of(values));
      const double hope = guess.mean - courage * guess.deviation;
      if (hope >= lowest || is_excluded(plan_, values)) continue;
      lowest = hope;
      best = std::move(values);
    }
    if (!best) break;
    // The next one is looked for as if this had come out as guessed.
    places.push_back(place_of(*best));
    heights.push_back(std::max(surrogate.at(places.back()).mean, 0.0));
    chosen.push_back(std::move(*best));
  }
  return chosen;
}

}  // namespace lk::emulator
