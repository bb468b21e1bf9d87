#pragma once

#include <string>

#include "emulator/scenario/junit_writer.hpp"

namespace lk::emulator {

/// "passed", "failed", "invalid".
const char* outcome_word(Outcome outcome);
/// Exit status: 0 passed, 1 failed, 3 invalid.
int exit_status(Outcome outcome);
double in_seconds(SimTime time);

/// Describes a planned fault: "jam of drive 1 began at 1 s, took effect at 1.001 s, …".
std::string fault_sentence(const PlannedFault& fault);

/// Returns the outcome, each expectation with its measurement, each fault with its effect, and
/// advice in `language`.
std::string report_text(const RunReport& report, bool in_colour,
                        Language language = Language::kEnglish);

}  // namespace lk::emulator
