#include "tools/campaign/plan/plan_check.hpp"

#include <algorithm>
#include <map>
#include <string>

#include "emulator/config/config_error.hpp"
#include "tools/campaign/plan/case_scenario.hpp"
#include "tools/campaign/plan/sampling.hpp"

namespace lk::emulator {
namespace {

/// All words; the least and the most of numbers.
std::vector<CaseValue> ends_of(const DimensionValues& values) {
  if (values.has_words()) return values.values();
  std::vector<CaseValue> ends;
  ends.emplace_back(values.least());
  ends.emplace_back(values.most());
  return ends;
}

/// The first case that is not excluded; without values when there is none among the first.
CaseValues first_case(const Plan& plan) {
  constexpr std::uint64_t kMostLooked = 1000;
  const CaseNumbers numbers(plan);
  for (std::uint64_t n = 0; n < std::min(numbers.numbers(), kMostLooked); ++n) {
    if (auto values = numbers.values(n)) return *std::move(values);
  }
  return {};
}

/// Reads cases as a run does; scenarios that differ in the fault alone are read once.
class CaseReader {
 public:
  explicit CaseReader(const Plan& plan) : scenarios_(plan) {}

  /// Throws ConfigError.
  void read(const CaseValues& values) {
    const auto [group, is_new] = read_.try_emplace(scenarios_.group_key(values));
    if (is_new) group->second = scenarios_.group(values).scenario;
    scenarios_.fault(values, group->second);
  }

 private:
  CaseScenarios scenarios_;
  std::map<std::string, Scenario> read_;
};

}  // namespace

void check_ends(const Plan& plan) {
  const CaseValues first = first_case(plan);
  if (first.empty()) return;
  CaseReader reader(plan);
  reader.read(first);
  const Dimension* const kinds = plan.find(Target::kFaultKind);
  const std::vector<CaseValue> all = kinds ? kinds->values.values() : std::vector<CaseValue>(1);
  for (const CaseValue& kind : all) {
    for (std::size_t changed = 0; changed < plan.dimensions.size(); ++changed) {
      const Dimension& dimension = plan.dimensions[changed];
      for (const CaseValue& end : ends_of(dimension.values)) {
        const CaseValues values = values_by_kind(plan, [&](std::size_t n) {
          if (&plan.dimensions[n] == kinds) return kind;
          if (n == changed) return end;
          // A bus without a bitrate does, and so does any load, but not together.
          const Dimension& other = plan.dimensions[n];
          const bool loads = other.target == Target::kBusLoad;
          if (loads && dimension.target == Target::kBitrate) return CaseValue(other.values.most());
          return first[n] ? *first[n] : ends_of(plan.dimensions[n].values).front();
        });
        if (!values[changed] || is_excluded(plan, values)) continue;
        try {
          reader.read(values);
        } catch (const ConfigError& problem) {
          throw ConfigError(plan.file.string(), 0, "dimension",
                            dimension.name + " = " + value_text(*values[changed]) + ": " +
                                problem.key + ": " + problem.reason);
        }
      }
    }
  }
}

}  // namespace lk::emulator
