#pragma once

/// @file Campaigns that never ran.

#include <chrono>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "tools/campaign/report/answer.hpp"
#include "tools/campaign/report/comparison.hpp"

namespace lk::emulator {

inline CampaignHead planted_head(Sampling sampling = Sampling::kRandom) {
  CampaignHead head;
  head.version = "1.0.0";
  head.plan_name = "every_fault";
  head.about = "A joint under every kind of fault";
  head.plan_text = "about = \"A joint under every kind of fault\"\n";
  head.input_hash = "0123abcd";
  head.sampling = sampling;
  head.numbers = 1000;
  head.cases = 1000;
  head.tolerant_time = std::chrono::milliseconds(200);
  head.dimensions = {{.name = "fault.kind", .words = {"jam", "drop", "dip"}},
                     {.name = "fault.for_s", .words = {}, .from = 0.1, .to = 0.5}};
  return head;
}

/// A case whose fault took effect at 1 s and met a running drive after a command A4.
inline CaseResult planted_case(std::uint64_t number, const std::string& kind, CaseOutcome outcome) {
  CaseResult result;
  result.number = number;
  result.values = {CaseValue(kind), CaseValue(0.1)};
  result.outcome = outcome;
  if (outcome == CaseOutcome::kNotFired) return result;
  result.fault_at = std::chrono::milliseconds(990);
  result.first_effect_at = std::chrono::seconds(1);
  result.state = "running";
  result.command = "A4";
  return result;
}

inline CaseResult detected_case(std::uint64_t number, const std::string& kind, CaseOutcome outcome,
                                std::chrono::milliseconds latency) {
  CaseResult result = planted_case(number, kind, outcome);
  auto& at =
      outcome == CaseOutcome::kDetectedByHost ? result.detected_by_host : result.detected_by_drive;
  at = *result.first_effect_at + latency;
  return result;
}

inline CaseStream stream_of(std::vector<CaseResult> results) {
  return [results = std::move(results)](const std::function<void(const CaseResult&)>& take) {
    for (const CaseResult& result : results) take(result);
  };
}

/// By number, as a file of results gives them.
inline CaseSource source_of(std::vector<CaseResult> results) {
  const auto all = std::make_shared<std::vector<CaseResult>>(std::move(results));
  return [all, n = std::size_t{0}]() mutable { return n < all->size() ? &(*all)[n++] : nullptr; };
}

}  // namespace lk::emulator
