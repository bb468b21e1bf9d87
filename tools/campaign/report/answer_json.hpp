#pragma once

#include <string>
#include <vector>

#include "tools/campaign/report/answer.hpp"
#include "tools/campaign/report/comparison.hpp"
#include "tools/campaign/report/thresholds.hpp"

namespace lk::emulator {

/// The whole answer as one JSON object on one line; docs/campaign-report.md has its keys. Text that
/// is no UTF-8 has replacement characters. `comparison` with an earlier campaign: null, there is
/// none.
std::string answer_json(const Answer& answer, const std::vector<ThresholdResult>& thresholds,
                        const Comparison* comparison = nullptr);

/// The comparison alone.
std::string comparison_json(const Comparison& comparison);

}  // namespace lk::emulator
