#include "tools/campaign/plan/plan.hpp"

#include <algorithm>

#include "emulator/core/faults/fault_table.hpp"

namespace lk::emulator {
namespace {

bool fits(const ExcludedValues& excluded, const CaseValues& values) {
  const std::optional<CaseValue>& value = values[excluded.dimension];
  if (!value) return false;
  if (!excluded.values.empty()) {
    return std::ranges::find(excluded.values, *value) != excluded.values.end();
  }
  const double* const number = std::get_if<double>(&*value);
  return number != nullptr && *number >= excluded.from && *number <= excluded.to;
}

}  // namespace

const Dimension* Plan::find(Target target) const {
  const auto found = std::ranges::find(dimensions, target, &Dimension::target);
  return found == dimensions.end() ? nullptr : &*found;
}

std::string key_of(const CaseValues& values) {
  std::string key;
  for (const auto& value : values) {
    const std::string text = value ? value_text(*value) : "";
    key += value ? std::to_string(text.size()) + ':' + text : "-";
  }
  return key;
}

bool applies(const Dimension& dimension, const FaultRow* kind) {
  switch (dimension.target) {
    case Target::kFaultId:
      return kind != nullptr && !kind->of_bus;
    case Target::kFaultFor:
      return kind != nullptr && !kind->momentary();
    case Target::kFaultProbability:
      return kind != nullptr && kind->per_frame;
    case Target::kFaultParam:
      return kind != nullptr && kind->word == dimension.kind;
    case Target::kFaultKind:
    case Target::kFaultBus:
    case Target::kFaultAt:
    case Target::kSeed:
    case Target::kBitrate:
    case Target::kGeneration:
    case Target::kBusLoad:
    case Target::kSupply:
    case Target::kAmbient:
    case Target::kLoad:
    case Target::kHost:
      return true;
  }
  return true;
}

const FaultRow* kind_of(const Plan& plan, const CaseValues& values) {
  for (std::size_t n = 0; n < plan.dimensions.size(); ++n) {
    if (plan.dimensions[n].target != Target::kFaultKind || !values[n]) continue;
    return find_fault(std::get<std::string>(*values[n]));
  }
  return nullptr;
}

CaseValues values_by_kind(const Plan& plan, const std::function<CaseValue(std::size_t)>& value_of) {
  CaseValues values(plan.dimensions.size());
  for (std::size_t n = 0; n < values.size(); ++n) {
    if (plan.dimensions[n].target == Target::kFaultKind) values[n] = value_of(n);
  }
  const FaultRow* const kind = kind_of(plan, values);
  for (std::size_t n = 0; n < values.size(); ++n) {
    if (!values[n] && applies(plan.dimensions[n], kind)) values[n] = value_of(n);
  }
  return values;
}

bool is_excluded(const Plan& plan, const CaseValues& values) {
  return std::ranges::any_of(plan.exclusions, [&](const Exclusion& exclusion) {
    return std::ranges::all_of(
        exclusion, [&](const ExcludedValues& excluded) { return fits(excluded, values); });
  });
}

}  // namespace lk::emulator
