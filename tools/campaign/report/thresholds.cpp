#include "tools/campaign/report/thresholds.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "emulator/core/scenario/scenario_text.hpp"
#include "emulator/ground/start_error.hpp"
#include "emulator/ground/text.hpp"

namespace lk::emulator {
namespace {

using Measure = Threshold::Measure;

struct LatencyWord {
  std::string_view word;
  double share;
};
constexpr std::array<LatencyWord, 3> kLatencyWords = {
    {{"latency.p50_s", 0.5}, {"latency.p99_s", 0.99}, {"latency.worst_s", 1}}};

[[noreturn]] void refuse(std::string_view text, const std::string& why) {
  throw StartError("--require \"" + on_one_line(text) + "\": " + why);
}

std::string measure_words() {
  std::string words = "coverage, coverage.lower";
  for (std::size_t n = 0; n < kCaseOutcomes; ++n) {
    words += ", " + outcome_key(static_cast<CaseOutcome>(n));
  }
  for (const LatencyWord& one : kLatencyWords) words += ", " + std::string(one.word);
  return words;
}

void read_measure(Threshold& threshold, std::string_view word) {
  if (word == "coverage" || word == "coverage.lower") {
    threshold.measure = word == "coverage" ? Measure::kCoverage : Measure::kCoverageLower;
    return;
  }
  for (const LatencyWord& one : kLatencyWords) {
    if (word != one.word) continue;
    threshold.measure = Measure::kLatency;
    threshold.share = one.share;
    return;
  }
  for (std::size_t n = 0; n < kCaseOutcomes; ++n) {
    const auto outcome = static_cast<CaseOutcome>(n);
    if (word != outcome_key(outcome)) continue;
    threshold.measure = Measure::kOutcome;
    threshold.outcome = outcome;
    return;
  }
  refuse(threshold.text, "\"" + on_one_line(word) + "\" is none of " + measure_words());
}

void read_limit(Threshold& threshold, std::string_view word) {
  const char* const end = word.data() + word.size();
  const auto [stop, error] = std::from_chars(word.data(), end, threshold.limit);
  if (error != std::errc() || stop != end || !std::isfinite(threshold.limit)) {
    refuse(threshold.text, "\"" + on_one_line(word) + "\" is not a number, like 0.99");
  }
  const bool is_share =
      threshold.measure == Measure::kCoverage || threshold.measure == Measure::kCoverageLower;
  if (is_share && (threshold.limit < 0 || threshold.limit > 1)) {
    refuse(threshold.text, "a coverage is from 0 to 1");
  }
  const bool is_whole = std::floor(threshold.limit) == threshold.limit;
  if (threshold.measure == Measure::kOutcome && (threshold.limit < 0 || !is_whole)) {
    refuse(threshold.text, "cases are counted in whole numbers from 0");
  }
  if (threshold.limit < 0) refuse(threshold.text, "a latency is 0 s or longer");
}

const KindAnswer& cases_of(const Answer& answer, const Threshold& threshold) {
  if (threshold.kind.empty()) return answer.all;
  const auto found = std::ranges::find(answer.kinds, threshold.kind, &KindAnswer::kind);
  if (found != answer.kinds.end()) return *found;
  std::string kinds;
  for (const KindAnswer& one : answer.kinds) kinds += (kinds.empty() ? "" : ", ") + one.kind;
  refuse(threshold.text, "the campaign has no fault \"" + on_one_line(threshold.kind) + "\", but " +
                             on_one_line(kinds));
}

std::optional<double> measured(const Answer& answer, const Threshold& threshold) {
  const KindAnswer& cases = cases_of(answer, threshold);
  switch (threshold.measure) {
    case Measure::kCoverage:
      return cases.coverage.share();
    case Measure::kCoverageLower:
      if (!cases.coverage.interval) {
        refuse(threshold.text,
               R"(there are bounds for sampling = "random" only, and this campaign has ")" +
                   std::string(kSamplingWords.at(static_cast<std::size_t>(answer.head.sampling))) +
                   "\"; coverage>=… needs none");
      }
      return cases.coverage.interval->lower;
    case Measure::kOutcome:
      return static_cast<double>(cases.count(threshold.outcome));
    case Measure::kLatency:
      if (const auto latency = cases.detected.quantile(threshold.share)) {
        return seconds_of(*latency);
      }
      return std::nullopt;
  }
  return std::nullopt;
}

}  // namespace

Threshold parse_threshold(std::string_view text) {
  Threshold threshold;
  threshold.text = trimmed(text);
  const std::string_view whole = threshold.text;
  const std::size_t sign = whole.find_first_of("<>=");
  if (sign == std::string_view::npos || sign + 1 >= whole.size() || whole[sign] == '=' ||
      whole[sign + 1] != '=') {
    refuse(text, "it is written MEASURE>=NUMBER or MEASURE<=NUMBER, like coverage>=0.99");
  }
  threshold.at_least = whole[sign] == '>';
  std::string_view word = trimmed(whole.substr(0, sign));
  const std::size_t bracket = word.find('[');
  if (bracket != std::string_view::npos) {
    if (!word.ends_with(']') || bracket + 2 >= word.size()) {
      refuse(text, "a kind of fault stands in brackets, like coverage[jam]>=0.9");
    }
    threshold.kind = word.substr(bracket + 1, word.size() - bracket - 2);
    word = word.substr(0, bracket);
  }
  read_measure(threshold, word);
  read_limit(threshold, trimmed(whole.substr(sign + 2)));
  return threshold;
}

std::vector<ThresholdResult> check_thresholds(const Answer& answer,
                                              const std::vector<Threshold>& thresholds) {
  std::vector<ThresholdResult> results;
  for (const Threshold& one : thresholds) {
    const std::optional<double> value = measured(answer, one);
    const bool holds =
        answer.missing == 0 && value && (one.at_least ? *value >= one.limit : *value <= one.limit);
    results.push_back({one.text, holds, value, answer.missing});
  }
  return results;
}

std::string threshold_sentence(const ThresholdResult& result) {
  const std::string measured =
      result.measured ? "measured " + number_text(*result.measured) : "nothing to measure";
  return result.text + ": " + measured +
         (result.missing > 0 ? ", but " + std::to_string(result.missing) + " cases are missing"
                             : "");
}

}  // namespace lk::emulator
