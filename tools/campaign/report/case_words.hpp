#pragma once

/// @file A case in words and figures, as all that is written of a campaign has them.

#include <optional>
#include <string>

#include "tools/campaign/results/case_result.hpp"

namespace lk::emulator {

/// Detected in time, by the drive or by the host.
constexpr bool is_covered(CaseOutcome outcome) {
  return outcome == CaseOutcome::kDetectedByDrive || outcome == CaseOutcome::kDetectedByHost;
}
/// What a campaign is for finding: late, silently wrong, hang, crash.
constexpr bool is_failure(CaseOutcome outcome) { return outcome >= CaseOutcome::kLate; }

/// "silently_wrong", "detected_by_drive": as thresholds and JSON name it.
std::string outcome_key(CaseOutcome outcome);

/// "fault.for_s=0.1, fault.jam.percent=60": what it has of these, but the kind of fault.
std::string values_text(const CaseResult& result, const CampaignHead& head);

/// Where the plan has the kind of fault; nothing: it has one only, or none.
std::optional<std::size_t> kind_dimension(const CampaignHead& head);
/// "jam"; "any" where the plan has no such dimension, "none" where the case has no fault.
std::string kind_of(const CaseResult& result, std::optional<std::size_t> dimension);

/// The first that noticed, since the first effect; nothing where there is no such time.
std::optional<SimTime> latency_of(const CaseResult& result);
/// Since the first effect of the case, of something that may not have been.
std::optional<SimTime> since_effect(const CaseResult& result, const std::optional<SimTime>& at);

/// Its note, and what the host said.
std::string note_of(const CaseResult& result);

double seconds_of(SimTime time);

/// A word of a POSIX shell's command line, quoted where it has to be.
std::string shell_word(const std::string& text);

}  // namespace lk::emulator
