#include <algorithm>
#include <set>
#include <utility>

#include "emulator/core/faults/fault_table.hpp"
#include "emulator/core/seed.hpp"
#include "tools/campaign/plan/sampling.hpp"

namespace lk::emulator {
namespace {

/// A value by the places of its dimension and of itself in the list.
using Choice = std::pair<std::size_t, std::size_t>;
using Pair = std::pair<Choice, Choice>;

/// Greedy, as AETG (Cohen, Dalal, Fredman, Patton 1997): each new case begins with a pair that has
/// not met yet, and takes for each other dimension the value that brings most new pairs.
class Cover {
 public:
  explicit Cover(const Plan& plan) : plan_(plan) {
    const std::size_t count = plan.dimensions.size();
    for (std::size_t a = 0; a < count; ++a) {
      for (std::size_t b = a + 1; b < count; ++b) add_pairs(a, b);
    }
  }

  std::vector<CaseValues> cases() {
    std::vector<CaseValues> cases;
    if (plan_.dimensions.size() == 1) {
      for (const CaseValue& value : plan_.dimensions[0].values.values()) {
        CaseValues one{value};
        if (!is_excluded(plan_, one)) cases.push_back(std::move(one));
      }
      return cases;
    }
    while (!open_.empty()) {
      const Pair first = *open_.begin();
      if (auto values = complete(first, cases.size())) {
        strike(*values);
        cases.push_back(std::move(*values));
      }
      open_.erase(first);  // met now, or nothing that is not excluded has it
    }
    return cases;
  }

 private:
  const CaseValue& value(const Choice& choice) const {
    return plan_.dimensions[choice.first].values.values()[choice.second];
  }
  void add_pairs(std::size_t a, std::size_t b) {
    for (std::size_t n = 0; n < plan_.dimensions[a].values.size(); ++n) {
      for (std::size_t m = 0; m < plan_.dimensions[b].values.size(); ++m) {
        open_.insert({{a, n}, {b, m}});
      }
    }
  }
  /// A case with both of them; nothing: there is none.
  std::optional<CaseValues> complete(const Pair& pair, std::size_t number) const {
    constexpr std::uint64_t kAttempts = 20;
    for (std::uint64_t attempt = 0; attempt < kAttempts; ++attempt) {
      CaseValues values(plan_.dimensions.size());
      values[pair.first.first] = value(pair.first);
      values[pair.second.first] = value(pair.second);
      if (fill(values, mix(plan_.head.seed + number * 64 + attempt), attempt > 0) &&
          !is_excluded(plan_, values)) {
        return values;
      }
    }
    return std::nullopt;
  }
  /// Returns false where what is given does not go together: a parameter of another fault.
  bool fill(CaseValues& values, std::uint64_t random, bool shuffle) const {
    std::vector<std::size_t> order;
    for (std::size_t n = 0; n < values.size(); ++n) order.push_back(n);
    std::ranges::stable_sort(order, {}, [&](std::size_t n) {
      return plan_.dimensions[n].target == Target::kFaultKind ? 0 : 1;
    });
    for (const std::size_t n : order) {
      const bool is_kind = plan_.dimensions[n].target == Target::kFaultKind;
      if (!is_kind && !applies(plan_.dimensions[n], kind_of(plan_, values))) {
        if (values[n]) return false;
        continue;
      }
      if (!values[n]) values[n] = best(values, n, is_kind, mix(random + n), shuffle);
    }
    return true;
  }
  CaseValue best(const CaseValues& values, std::size_t dimension, bool is_kind,
                 std::uint64_t random, bool shuffle) const {
    const auto& choices = plan_.dimensions[dimension].values.values();
    if (shuffle && !is_kind) return choices[random % choices.size()];
    std::size_t best = random % choices.size();
    std::size_t most = 0;
    for (std::size_t n = 0; n < choices.size(); ++n) {
      CaseValues with = values;
      with[dimension] = choices[n];
      // A parameter that stands already decides the kind.
      const bool goes = !is_kind || goes_together(with);
      const std::size_t gain = goes ? 1 + new_pairs(values, {dimension, n}) : 0;
      if (gain > most) {
        most = gain;
        best = n;
      }
    }
    return choices[best];
  }
  bool goes_together(const CaseValues& values) const {
    const FaultRow* const kind = kind_of(plan_, values);
    for (std::size_t n = 0; n < values.size(); ++n) {
      if (values[n] && !applies(plan_.dimensions[n], kind)) return false;
    }
    return true;
  }
  std::size_t new_pairs(const CaseValues& values, const Choice& choice) const {
    std::size_t count = 0;
    for (std::size_t n = 0; n < values.size(); ++n) {
      if (!values[n] || n == choice.first) continue;
      count += open_.count(ordered(choice_of(n, *values[n]), choice));
    }
    return count;
  }
  Choice choice_of(std::size_t dimension, const CaseValue& value) const {
    const auto& all = plan_.dimensions[dimension].values.values();
    return {dimension, static_cast<std::size_t>(std::ranges::find(all, value) - all.begin())};
  }
  static Pair ordered(const Choice& a, const Choice& b) {
    return a.first < b.first ? Pair{a, b} : Pair{b, a};
  }
  void strike(const CaseValues& values) {
    for (std::size_t a = 0; a < values.size(); ++a) {
      for (std::size_t b = a + 1; b < values.size(); ++b) {
        if (values[a] && values[b])
          open_.erase({choice_of(a, *values[a]), choice_of(b, *values[b])});
      }
    }
  }

  const Plan& plan_;
  std::set<Pair> open_;
};

}  // namespace

std::vector<CaseValues> pairwise_cases(const Plan& plan) { return Cover(plan).cases(); }

}  // namespace lk::emulator
