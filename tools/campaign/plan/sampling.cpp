#include "tools/campaign/plan/sampling.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "emulator/config/config_error.hpp"
#include "emulator/core/faults/fault_table.hpp"
#include "emulator/core/seed.hpp"

namespace lk::emulator {
namespace {

constexpr std::uint64_t kMost = std::numeric_limits<std::int64_t>::max();

std::uint64_t times(std::uint64_t a, std::uint64_t b) {
  return b != 0 && a > kMost / b ? kMost : a * b;
}

std::uint64_t bits(std::uint64_t seed, std::uint64_t number, std::uint64_t dimension,
                   std::uint64_t attempt) {
  return mix(mix(mix(seed) + number) + mix(dimension * 1024 + attempt));
}

/// The kinds of fault of the plan; one null where it has none.
std::vector<const FaultRow*> kinds_of(const Plan& plan) {
  const Dimension* const kinds = plan.find(Target::kFaultKind);
  if (kinds == nullptr) return {nullptr};
  std::vector<const FaultRow*> rows;
  for (const CaseValue& word : kinds->values.values()) {
    rows.push_back(find_fault(std::get<std::string>(word)));
  }
  return rows;
}

std::uint64_t cases_of(const Plan& plan, const FaultRow* kind) {
  std::uint64_t cases = 1;
  for (const Dimension& dimension : plan.dimensions) {
    if (dimension.target == Target::kFaultKind || !applies(dimension, kind)) continue;
    cases = times(cases, dimension.values.size());
  }
  return cases;
}

/// The place of `number` in an order of 0 to count − 1 that `key` shuffles: a Feistel network over
/// the next power of four, walked until it is within.
std::uint64_t shuffled(std::uint64_t number, std::uint64_t count, std::uint64_t key) {
  unsigned half = 1;
  while (half < 31 && (std::uint64_t{1} << (2 * half)) < count) ++half;
  const std::uint64_t mask = (std::uint64_t{1} << half) - 1;
  do {
    std::uint64_t left = number >> half;
    std::uint64_t right = number & mask;
    for (std::uint64_t round = 0; round < 6; ++round) {
      const std::uint64_t next = left ^ (mix(mix(key + round) + right) & mask);
      left = right;
      right = next;
    }
    number = (left << half) | right;
  } while (number >= count);
  return number;
}

}  // namespace

CaseValues drawn_values(const Plan& plan, std::uint64_t number, std::uint64_t attempt) {
  return values_by_kind(plan, [&](std::size_t n) {
    return plan.dimensions[n].values.quantile(uniform(bits(plan.head.seed, number, n, attempt)));
  });
}

CaseValues random_values(const Plan& plan, std::uint64_t number) {
  constexpr std::uint64_t kMostAttempts = 1000;
  for (std::uint64_t attempt = 0; attempt < kMostAttempts; ++attempt) {
    CaseValues values = drawn_values(plan, number, attempt);
    if (!is_excluded(plan, values)) return values;
  }
  throw ConfigError(plan.file.string(), 0, "exclude",
                    "leaves next to nothing, a thousand draws were excluded");
}

CaseNumbers::CaseNumbers(const Plan& plan) : plan_(plan), numbers_(plan.head.numbers) {
  if (plan.head.sampling == Sampling::kFull) {
    before_kind_.push_back(0);
    for (const FaultRow* kind : kinds_of(plan)) {
      const std::uint64_t cases = cases_of(plan, kind);
      before_kind_.push_back(std::min(before_kind_.back() + cases, kMost));
    }
    numbers_ = before_kind_.back();
  } else if (plan.head.sampling == Sampling::kPairwise) {
    pairwise_ = pairwise_cases(plan);
    numbers_ = pairwise_.size();
  }
}

std::optional<CaseValues> CaseNumbers::values(std::uint64_t number) const {
  CaseValues values;
  switch (plan_.head.sampling) {
    case Sampling::kFull:
      values = full(number);
      break;
    case Sampling::kLatin:
      values = latin(number);
      break;
    case Sampling::kPairwise:
      return pairwise_[number];
    case Sampling::kRandom:
    case Sampling::kAdaptive:
      return random_values(plan_, number);
  }
  if (is_excluded(plan_, values)) return std::nullopt;
  return values;
}

CaseValues CaseNumbers::full(std::uint64_t number) const {
  const auto after = std::ranges::upper_bound(before_kind_, number);
  const auto kind = static_cast<std::size_t>(after - before_kind_.begin()) - 1;
  std::uint64_t rest = number - before_kind_[kind];
  const FaultRow* const row = kinds_of(plan_)[kind];
  CaseValues values(plan_.dimensions.size());
  for (std::size_t n = values.size(); n-- > 0;) {  // the last one varies fastest
    const Dimension& dimension = plan_.dimensions[n];
    if (dimension.target == Target::kFaultKind) {
      values[n] = dimension.values.values()[kind];
    } else if (applies(dimension, row)) {
      values[n] = dimension.values.values()[rest % dimension.values.size()];
      rest /= dimension.values.size();
    }
  }
  return values;
}

/// Each dimension is cut into as many slices as there are cases, and each slice is met once.
CaseValues CaseNumbers::latin(std::uint64_t number) const {
  return values_by_kind(plan_, [&](std::size_t n) {
    const std::uint64_t seed = plan_.head.seed;
    const std::uint64_t slice = shuffled(number, numbers_, mix(seed + n * 0x9E37));
    const double within = uniform(bits(seed, number, n, 0));
    return plan_.dimensions[n].values.quantile(
        std::min((static_cast<double>(slice) + within) / static_cast<double>(numbers_),
                 std::nextafter(1.0, 0.0)));
  });
}

}  // namespace lk::emulator
