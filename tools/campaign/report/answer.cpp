#include "tools/campaign/report/answer.hpp"

#include <algorithm>
#include <numeric>
#include <unordered_map>
#include <utility>

#include "emulator/core/scenario/scenario_text.hpp"

namespace lk::emulator {
namespace {

void add_unknown(std::vector<std::string>& words, const std::string& word) {
  if (std::ranges::find(words, word) == words.end()) words.push_back(word);
}

/// Counts while the results go by.
class Gathering {
 public:
  Gathering(const CampaignHead& head, Answer& answer)
      : answer_(answer), dimension_(kind_dimension(head)) {
    if (dimension_) {
      for (const std::string& word : head.dimensions[*dimension_].words) kind(word);
    }
    Space& space = answer_.space;
    space.states = {state_word(RunState::kOff), state_word(RunState::kStopped),
                    state_word(RunState::kRunning)};
  }

  void add(const CaseResult& result) {
    const std::string word = kind_of(result, dimension_);
    count(answer_.all, result);
    count(kind(word), result);
    if (result.real_time) ++answer_.real_time;
    if (result.flips > 0) ++answer_.flipped;
    if (result.outcome != CaseOutcome::kNotFired) meet(word, result);
    if (is_failure(result.outcome)) keep(result);
  }

  void finish() {
    Answer& answer = answer_;
    std::ranges::sort(answer.residual, {}, &CaseResult::number);
    std::ranges::sort(answer.space.commands);
    const Sampling sampling = answer.head.sampling;
    answer.all.coverage = coverage_of(answer.all.outcomes, sampling);
    for (KindAnswer& one : answer.kinds) {
      one.coverage = coverage_of(one.outcomes, sampling);
      answer.space.kinds.push_back(one.kind);
    }
  }

 private:
  static void count(KindAnswer& of, const CaseResult& result) {
    ++of.outcomes.at(static_cast<std::size_t>(result.outcome));
    if (result.outcome == CaseOutcome::kNotFired) return;
    if (const auto it = since_effect(result, result.detected_by_drive)) of.by_drive.add(*it);
    if (const auto it = since_effect(result, result.detected_by_host)) of.by_host.add(*it);
    if (const auto it = latency_of(result)) of.detected.add(*it);
  }

  KindAnswer& kind(const std::string& word) {
    const auto [place, is_new] = places_.try_emplace(word, answer_.kinds.size());
    if (is_new) answer_.kinds.emplace_back().kind = word;
    return answer_.kinds[place->second];
  }

  void meet(const std::string& word, const CaseResult& result) {
    // Of what a host program has commanded, and of its drive then, nothing is known.
    if (result.state.empty() && result.command.empty()) return;
    const std::string state = result.state.empty() ? "unknown" : result.state;
    const std::string command = result.command.empty() ? "none" : result.command;
    Space& space = answer_.space;
    const auto [place, is_new] = space.cells.try_emplace({word, state, command});
    if (is_new) {
      add_unknown(space.states, state);
      add_unknown(space.commands, command);
    }
    ++place->second.cases;
    if (is_failure(result.outcome)) ++place->second.failures;
  }

  void keep(const CaseResult& result) {
    if (answer_.all.count(result.outcome) > Answer::kMostOfOutcome) {
      ++answer_.residual_left_out;
    } else {
      answer_.residual.push_back(result);
    }
  }

  Answer& answer_;
  std::optional<std::size_t> dimension_;
  std::unordered_map<std::string, std::size_t> places_;
};

}  // namespace

std::optional<double> Coverage::share() const {
  if (dangerous == 0) return std::nullopt;
  return static_cast<double>(covered) / static_cast<double>(dangerous);
}

Coverage coverage_of(const OutcomeCounts& outcomes, Sampling sampling) {
  Coverage coverage;
  for (std::size_t n = 0; n < kCaseOutcomes; ++n) {
    const auto outcome = static_cast<CaseOutcome>(n);
    if (is_covered(outcome)) coverage.covered += outcomes.at(n);
    if (is_covered(outcome) || is_failure(outcome)) coverage.dangerous += outcomes.at(n);
  }
  if (sampling == Sampling::kRandom) {
    coverage.interval = clopper_pearson(coverage.covered, coverage.dangerous);
    for (const double claim : {0.9, 0.99}) {
      coverage.needs.push_back(claim_need(coverage.covered, coverage.dangerous, claim));
    }
  }
  return coverage;
}

std::uint64_t KindAnswer::cases() const {
  return std::accumulate(outcomes.begin(), outcomes.end(), std::uint64_t{0});
}

std::uint64_t KindAnswer::failures() const {
  return count(CaseOutcome::kLate) + count(CaseOutcome::kSilentlyWrong) +
         count(CaseOutcome::kHang) + count(CaseOutcome::kCrash);
}

Space::Cell Space::at(const std::string& kind, const std::string& state,
                      const std::string& command) const {
  const auto found = cells.find({kind, state, command});
  return found != cells.end() ? found->second : Cell{};
}

std::string Answer::command_of(std::uint64_t number) const {
  const bool from_store = head.sampling == Sampling::kAdaptive && !store_file.empty();
  return "lk-emu campaign " + shell_word(plan_file) +
         (from_store ? " -o " + shell_word(store_file) : "") + " --case " + std::to_string(number);
}

Answer answer_of(const CampaignHead& head, const CaseStream& results, std::string plan_file) {
  Answer answer;
  answer.head = head;
  answer.plan_file = std::move(plan_file);
  if (answer.plan_file.empty()) answer.plan_file = head.plan_called.word;
  if (answer.plan_file.empty()) answer.plan_file = head.plan_name + ".toml";
  Gathering gathering(head, answer);
  results([&](const CaseResult& result) { gathering.add(result); });
  gathering.finish();
  return answer;
}

}  // namespace lk::emulator
