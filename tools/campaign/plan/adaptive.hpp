#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "tools/campaign/plan/plan.hpp"

namespace lk::emulator {

/// Which cases `adaptive` runs next, from what became of those before: generations of kGeneration
/// cases. Part of each is drawn from the plan's distributions; the other part is bred from the
/// cases that came nearest to failing, for as long as that gets nearer (docs/campaigns.md). The
/// same results give the same cases.
class AdaptiveSampler {
 public:
  static constexpr std::size_t kGeneration = 16;

  /// `plan` must outlive this.
  explicit AdaptiveSampler(const Plan& plan) : plan_(plan) {}

  /// The cases of the next generation.
  std::vector<CaseValues> next();
  /// What became of them, in their order. Counts from the next generation on.
  void learn(const std::vector<CaseResult>& results);

 private:
  /// A case that has been run, and where it lies: of each dimension a share from 0 to 1.
  struct Tried {
    CaseValues values;
    std::vector<double> place;
    double distance = 0;  // from failing: 0 has failed
    bool bred = false;
  };
  /// Numbers of this generation.
  class Random;

  std::size_t bred_count() const;
  std::optional<CaseValues> bred(Random& random) const;
  std::vector<double> mutated(const Tried& parent, Random& random) const;
  std::vector<double> crossed(const Tried& parent, Random& random) const;
  CaseValues values_at(const std::vector<double>& place) const;
  void judge_generation(double best_before);

  const Plan& plan_;
  std::uint64_t generation_ = 0;
  std::vector<CaseValues> running_;
  std::size_t running_bred_ = 0;  // the first of them
  std::vector<Tried> tried_;      // those that say something, nearest to failing first
  std::size_t credit_ = 0;        // generations for which breeding goes on without getting nearer
};

}  // namespace lk::emulator
