#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "tools/campaign/plan/plan.hpp"
#include "tools/campaign/plan/surrogate.hpp"

namespace lk::emulator {

/// Which cases `adaptive` runs next, from what became of those before: generations of kGeneration
/// cases. Part of each is drawn from the plan's distributions. The others are those, of many that
/// could be run, of which a surrogate of the cases so far hopes most to be near failing, for as
/// long as that gets nearer (docs/campaigns.md). The same results give the same cases.
class AdaptiveSampler {
 public:
  static constexpr std::size_t kGeneration = 8;

  /// `plan` must outlive this.
  explicit AdaptiveSampler(const Plan& plan);

  /// The cases of the next generation.
  std::vector<CaseValues> next();
  /// What became of them, in their order. Counts from the next generation on.
  void learn(const std::vector<CaseResult>& results);

 private:
  /// A case that has been run.
  struct Tried {
    Place place;
    double distance = 0;  // from failing: 0 has failed
  };
  /// The cases of one kind of fault: which kind is worst shows late, so each has its turn.
  struct Niche {
    std::optional<double> place;  // of the kind; nothing: of all cases
    double best = 0;              // distance
    std::size_t credit = 0;       // generations for which it goes on without getting nearer
    bool used = false;            // in the generation under way
  };
  /// Numbers of this generation.
  class Random;

  Place place_of(const CaseValues& values) const;
  CaseValues values_at(const Place& place) const;
  Place candidate(const Niche& niche, Random& random) const;
  Place mutated(const Place& parent, Random& random) const;
  bool is_of(const Place& place, const Niche& niche) const;
  /// The niches of the next hopeful cases.
  std::vector<const Niche*> turns();
  /// The most hopeful case of each of these niches.
  std::vector<CaseValues> hopeful(const std::vector<const Niche*>& niches, Random& random) const;

  const Plan& plan_;
  std::vector<bool> words_;  // dimensions that are words
  std::uint64_t generation_ = 0;
  std::vector<CaseValues> running_;
  std::vector<Tried> tried_;         // those that say something, nearest to failing first
  std::optional<std::size_t> kind_;  // the dimension of the kind of fault
  std::vector<Niche> niches_;        // the first one is all cases
};

}  // namespace lk::emulator
