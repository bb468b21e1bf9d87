#include "tools/campaign/report/comparison.hpp"

#include <algorithm>

#include "emulator/ground/start_error.hpp"
#include "emulator/ground/text.hpp"

namespace lk::emulator {
namespace {

constexpr std::uint8_t kAbsent = kCaseOutcomes;

/// Outcomes by number.
class Outcomes {
 public:
  void set(std::uint64_t number, std::uint8_t outcome) {
    if (number >= list_.size()) list_.resize(number + 1, kAbsent);
    list_[number] = outcome;
  }
  std::uint8_t at(std::uint64_t number) const {
    return number < list_.size() ? list_[number] : kAbsent;
  }
  std::uint64_t present() const {
    return list_.size() - static_cast<std::uint64_t>(std::ranges::count(list_, kAbsent));
  }

 private:
  std::vector<std::uint8_t> list_;
};

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

Comparison compare_campaigns(const CampaignHead& before, const CaseStream& results_before,
                             const CampaignHead& now, const CaseStream& results_now) {
  check_same_plan(before, now);
  Outcomes outcomes;
  results_before([&](const CaseResult& result) {
    check_number(before, result);
    outcomes.set(result.number, static_cast<std::uint8_t>(result.outcome));
  });
  Comparison comparison;
  comparison.before = before;
  comparison.now = now;
  std::uint64_t met = 0;
  results_now([&](const CaseResult& result) {
    check_number(now, result);
    const std::uint8_t was = outcomes.at(result.number);
    if (was == kAbsent) {
      ++comparison.only_now;
    } else {
      ++met;
      count_move(comparison, static_cast<CaseOutcome>(was), result);
    }
  });
  comparison.only_before = outcomes.present() - met;
  std::ranges::sort(comparison.cases, {}, [](const WorseCase& one) { return one.now.number; });
  return comparison;
}

}  // namespace lk::emulator
