#include "tools/campaign/report/comparison.hpp"

#include <algorithm>
#include <optional>
#include <string>

#include "emulator/ground/start_error.hpp"
#include "emulator/ground/text.hpp"

namespace lk::emulator {
namespace {

[[noreturn]] void refuse_other_plan(const std::string& what) {
  throw StartError("compare: the campaigns are not of the same plan: " + on_one_line(what));
}

std::string sampling_word(const CampaignHead& head) {
  return std::string(kSamplingWords.at(static_cast<std::size_t>(head.sampling)));
}

void check_dimensions(const CampaignHead& before, const CampaignHead& now) {
  const auto [old_one, new_one] = std::ranges::mismatch(before.dimensions, now.dimensions);
  const bool old_ends = old_one == before.dimensions.end();
  const bool new_ends = new_one == now.dimensions.end();
  if (old_ends && new_ends) return;
  if (old_ends) refuse_other_plan("dimension " + new_one->name + " was not there");
  if (new_ends) refuse_other_plan("dimension " + old_one->name + " is gone");
  refuse_other_plan(old_one->name == new_one->name
                        ? "dimension " + old_one->name + " has other values"
                        : "dimension " + old_one->name + " was where " + new_one->name + " is");
}

void check_same_plan(const CampaignHead& before, const CampaignHead& now) {
  if (before.sampling != now.sampling) {
    refuse_other_plan("sampling was " + sampling_word(before) + " and is " + sampling_word(now));
  }
  if (before.seed != now.seed) {
    refuse_other_plan("seed was " + std::to_string(before.seed) + " and is " +
                      std::to_string(now.seed));
  }
  check_dimensions(before, now);
  if (before.numbers != now.numbers) {
    refuse_other_plan("it had " + std::to_string(before.numbers) + " numbers and has " +
                      std::to_string(now.numbers));
  }
  if (now.sampling == Sampling::kAdaptive) {
    throw StartError(
        "compare: what an adaptive campaign samples depends on its results, so that its numbers "
        "are of other cases each time; compare campaigns of another sampling");
  }
}

void check_number(const CampaignHead& head, const CaseResult& result) {
  if (result.number >= head.numbers) {
    throw StartError("compare: case " + std::to_string(result.number) + " is not one of the " +
                     std::to_string(head.numbers) + " of its plan");
  }
}

/// Dimensions tell their ends only: what is drawn between them, a list or a weight may differ.
void check_same_case(const CampaignHead& head, const CaseResult& before, const CaseResult& now) {
  const auto text = [](const std::optional<CaseValue>& value) {
    return value ? value_text(*value) : std::string("nothing");
  };
  for (std::size_t n = 0; n < head.dimensions.size(); ++n) {
    if (before.values[n] == now.values[n]) continue;
    refuse_other_plan("case " + std::to_string(now.number) + " had " + head.dimensions[n].name +
                      " = " + text(before.values[n]) + " and has " + text(now.values[n]));
  }
}

void count_move(Comparison& comparison, CaseOutcome before, const CaseResult& result) {
  const CaseOutcome now = result.outcome;
  ++comparison.moves.at(static_cast<std::size_t>(before)).at(static_cast<std::size_t>(now));
  if (before == now) {
    ++comparison.same;
  } else if (before == CaseOutcome::kNotFired || now == CaseOutcome::kNotFired) {
    ++comparison.not_fired;
  } else if (now < before) {
    ++comparison.better;
  } else {
    ++comparison.worse;
    if (comparison.cases.size() < Comparison::kMostWorse) {
      comparison.cases.push_back({before, result});
    } else {
      ++comparison.cases_left_out;
    }
  }
}

}  // namespace

Comparison compare_campaigns(const CampaignHead& before, const CaseSource& next_before,
                             const CampaignHead& now, const CaseSource& next_now) {
  check_same_plan(before, now);
  Comparison comparison;
  comparison.before = before;
  comparison.now = now;
  const CaseResult* old_one = next_before();
  const CaseResult* new_one = next_now();
  while (old_one != nullptr || new_one != nullptr) {
    const bool old_is_due =
        new_one == nullptr || (old_one != nullptr && old_one->number <= new_one->number);
    const bool new_is_due =
        old_one == nullptr || (new_one != nullptr && new_one->number <= old_one->number);
    if (old_is_due) check_number(before, *old_one);
    if (new_is_due) check_number(now, *new_one);
    if (old_is_due && new_is_due) {
      check_same_case(now, *old_one, *new_one);
      count_move(comparison, old_one->outcome, *new_one);
    } else {
      ++(old_is_due ? comparison.only_before : comparison.only_now);
    }
    if (old_is_due) old_one = next_before();
    if (new_is_due) new_one = next_now();
  }
  return comparison;
}

}  // namespace lk::emulator
