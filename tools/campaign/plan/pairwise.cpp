#include <algorithm>
#include <set>
#include <utility>

#include "emulator/config/config_error.hpp"
#include "emulator/core/faults/fault_table.hpp"
#include "emulator/core/seed.hpp"
#include "tools/campaign/plan/sampling.hpp"

namespace lk::emulator {
namespace {

/// A value by the places of its dimension and of itself in the list.
using Choice = std::pair<std::size_t, std::size_t>;
using Pair = std::pair<Choice, Choice>;

/// Greedy, as AETG (Cohen, Dalal, Fredman, Patton 1997): each new case begins with a pair that has
/// not met yet, and takes for each other dimension the value that brings most new pairs, as far as
/// exclusions let it.
class Cover {
 public:
  explicit Cover(const Plan& plan) : plan_(plan) {
    const std::size_t count = plan.dimensions.size();
    check_size();
    for (std::size_t n = 0; n < count; ++n) order_.push_back(n);
    std::ranges::stable_sort(order_, {}, [&](std::size_t n) { return rank(n); });
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
  static constexpr std::uint64_t kMostPairs = 10'000'000;  // a GB of memory, about
  static constexpr std::uint64_t kMostLooks = 100'000;     // a second, for one pair

  void check_size() const {
    double values = 0;  // of all dimensions before
    double pairs = 0;
    for (const Dimension& dimension : plan_.dimensions) {
      pairs += values * static_cast<double>(dimension.values.size());
      values += static_cast<double>(dimension.values.size());
    }
    if (pairs <= static_cast<double>(kMostPairs)) return;
    throw ConfigError(plan_.file.string(), 0, "sampling",
                      "pairwise has more than 10 million pairs of values to let meet: shorten the "
                      "lists, or take random");
  }
  /// The kind of fault decides what else counts; what no exclusion looks at can wait.
  int rank(std::size_t n) const {
    if (plan_.dimensions[n].target == Target::kFaultKind) return 0;
    const bool excludes = std::ranges::any_of(plan_.exclusions, [&](const Exclusion& exclusion) {
      return std::ranges::find(exclusion, n, &ExcludedValues::dimension) != exclusion.end();
    });
    return excludes ? 1 : 2;
  }
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
    CaseValues values(plan_.dimensions.size());
    values[pair.first.first] = value(pair.first);
    values[pair.second.first] = value(pair.second);
    std::uint64_t looks = 0;
    if (is_excluded(plan_, values) || !fill(values, 0, mix(plan_.head.seed + number), looks)) {
      return std::nullopt;
    }
    return values;
  }
  /// Gives values to dimensions from `place` of the order on: what brings most new pairs first, and
  /// where that leads to nothing but excluded cases, the next. False: all do.
  bool fill(CaseValues& values, std::size_t place, std::uint64_t random,
            std::uint64_t& looks) const {
    if (place == order_.size()) return true;
    const std::size_t n = order_[place];
    const bool is_kind = plan_.dimensions[n].target == Target::kFaultKind;
    if (!is_kind && !applies(plan_.dimensions[n], kind_of(plan_, values))) {
      return fill(values, place + 1, random, looks);
    }
    // What is given does not go together, where it is a parameter of another fault.
    if (values[n]) {
      return (!is_kind || goes_together(values)) && fill(values, place + 1, random, looks);
    }
    for (const std::size_t choice : by_gain(values, n, mix(random + n))) {
      if (++looks > kMostLooks) give_up();
      values[n] = value({n, choice});
      const bool possible = !is_excluded(plan_, values) && (!is_kind || goes_together(values));
      if (possible && fill(values, place + 1, random, looks)) return true;
    }
    values[n].reset();
    return false;
  }
  /// The values of a dimension, with most new pairs first; among equals, as `random` says.
  std::vector<std::size_t> by_gain(const CaseValues& values, std::size_t dimension,
                                   std::uint64_t random) const {
    const std::size_t count = plan_.dimensions[dimension].values.size();
    std::vector<std::pair<std::size_t, std::size_t>> gains;  // and the value's place
    for (std::size_t n = 0; n < count; ++n) {
      const std::size_t choice = (random + n) % count;
      gains.emplace_back(new_pairs(values, {dimension, choice}), choice);
    }
    std::ranges::stable_sort(gains, std::ranges::greater{},
                             [](const auto& one) { return one.first; });
    std::vector<std::size_t> choices;
    for (const auto& [gain, choice] : gains) choices.push_back(choice);
    return choices;
  }
  [[noreturn]] void give_up() const {
    throw ConfigError(plan_.file.string(), 0, "exclude",
                      "which pairs it leaves possible takes too long to find out: exclude less, or "
                      "by fewer dimensions");
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
  std::vector<std::size_t> order_;  // of dimensions, as they are given values
  std::set<Pair> open_;
};

}  // namespace

std::vector<CaseValues> pairwise_cases(const Plan& plan) { return Cover(plan).cases(); }

}  // namespace lk::emulator
