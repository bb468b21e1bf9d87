#pragma once

/// @file Which cases a plan has. A case's number is stable, and gives its values without the
/// others.

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "tools/campaign/plan/plan.hpp"

namespace lk::emulator {

/// The cases of a plan whose sampling is not adaptive: numbers in, values out.
class CaseNumbers {
 public:
  /// `plan` must outlive this.
  explicit CaseNumbers(const Plan& plan);

  /// Cases are numbered from 0 to this − 1. More than 2^63 are that many.
  std::uint64_t numbers() const { return numbers_; }
  /// The values of a case; nothing: it is excluded.
  std::optional<CaseValues> values(std::uint64_t number) const;

 private:
  CaseValues full(std::uint64_t number) const;
  CaseValues latin(std::uint64_t number) const;

  const Plan& plan_;
  std::uint64_t numbers_ = 0;
  std::vector<std::uint64_t> before_kind_;  // `full`: cases of the kinds before each, and of all
  std::vector<CaseValues> pairwise_;
};

/// The values of `number` as drawn from the plan's distributions; another draw for each `attempt`.
CaseValues drawn_values(const Plan& plan, std::uint64_t number, std::uint64_t attempt);
/// The first draw that is not excluded. Throws ConfigError after a thousand.
CaseValues random_values(const Plan& plan, std::uint64_t number);

/// A few cases in which any two values of any two dimensions meet, but those that are excluded.
std::vector<CaseValues> pairwise_cases(const Plan& plan);

}  // namespace lk::emulator
