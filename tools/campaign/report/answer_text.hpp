#pragma once

#include <string>
#include <vector>

#include "tools/campaign/report/answer.hpp"
#include "tools/campaign/report/comparison.hpp"
#include "tools/campaign/report/thresholds.hpp"

namespace lk::emulator {

/// The answer for a terminal: the matrix, coverage, latencies, space, the first failures of each
/// outcome, and what is required. No colours, lines of any length.
std::string answer_text(const Answer& answer, const std::vector<ThresholdResult>& thresholds);

/// "12 cases worse, 3 better, …", what has moved where, and the first of the worse. `plan_file` is
/// for commands; empty: the plan's name and ".toml".
std::string comparison_text(const Comparison& comparison, const std::string& plan_file = "");

/// "case 4711: jam, silently wrong, "the forearm stands still" failed at 2.1 s (fault.for_s=0.1)".
std::string case_sentence(const CaseResult& result, const CampaignHead& head);

/// "183 of 184 dangerous cases were detected in time, 0.9946, 95 % interval 0.9701 to 0.9999".
std::string coverage_sentence(const Coverage& coverage, Sampling sampling);

}  // namespace lk::emulator
