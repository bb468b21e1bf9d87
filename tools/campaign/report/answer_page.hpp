#pragma once

#include <string>
#include <vector>

#include "tools/campaign/report/answer.hpp"
#include "tools/campaign/report/comparison.hpp"
#include "tools/campaign/report/thresholds.hpp"

namespace lk::emulator {

/// The answer as one HTML page that needs nothing else: style, scripts and data are in it, and its
/// content security policy lets it fetch nothing. What it shows is answer_json; texts get into it
/// as texts only. `comparison` with an earlier campaign: null, there is none.
std::string answer_page(const Answer& answer, const std::vector<ThresholdResult>& thresholds,
                        const Comparison* comparison = nullptr);

}  // namespace lk::emulator
