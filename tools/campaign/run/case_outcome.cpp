#include "tools/campaign/run/case_outcome.hpp"

#include <algorithm>
#include <chrono>

namespace lk::emulator {
namespace {

using namespace std::chrono_literals;
using Status = ExpectationResult::Status;

void take_earlier(std::optional<SimTime>& first, std::optional<SimTime> at) {
  if (at && (!first || *at < *first)) first = at;
}

/// The results in the order of the scenario's expectations.
std::vector<const ExpectationResult*> in_order(const CaseGroup& group, const Verdict& verdict) {
  std::vector<const ExpectationResult*> results;
  for (const std::size_t place : group.order) results.push_back(&verdict.expectations[place]);
  return results;
}

/// When what is watched came about; nothing: it did not.
std::optional<SimTime> fired(const ExpectationResult& result, bool by_failing) {
  if (by_failing) return result.status == Status::kFailed ? result.decided_at : std::nullopt;
  return result.status == Status::kPassed ? result.at : std::nullopt;
}

/// When it came about because of the fault: without it, it did not, or later.
std::optional<SimTime> noticed(const ExpectationResult& without, const ExpectationResult& with,
                               bool by_failing) {
  const auto anyway = fired(without, by_failing);
  const auto at = fired(with, by_failing);
  return at && (!anyway || *at < *anyway) ? at : std::nullopt;
}

void judge_own(const CaseGroup& group, const std::vector<const ExpectationResult*>& without,
               const std::vector<const ExpectationResult*>& with, CaseResult& result) {
  for (std::size_t n = 0; n < group.watched.own; ++n) {
    // What fails anyway says nothing of the fault.
    if (!group.hazardous[n] || without[n]->status != Status::kPassed) continue;
    if (with[n]->margin) {
      result.margin = std::min(result.margin.value_or(*with[n]->margin), *with[n]->margin);
    }
    if (with[n]->status == Status::kPassed) continue;
    const SimTime at = with[n]->decided_at.value_or(SimTime{0});
    if (result.violated_at && *result.violated_at <= at) continue;
    result.violated_at = at;
    result.violated = with[n]->says.empty() ? with[n]->expected : with[n]->says;
  }
}

/// The one that the scenario itself does not plan; null: there is none.
const PlannedFault* fault_of_case(const Verdict& without, const Verdict& with) {
  for (std::size_t n = 0; n < with.faults.size(); ++n) {
    const bool own = n < without.faults.size() && with.faults[n].bus == without.faults[n].bus &&
                     with.faults[n].report.fault.name == without.faults[n].report.fault.name;
    if (!own) return &with.faults[n];
  }
  return nullptr;
}

bool in_time(std::optional<SimTime> at, const CaseResult& result, std::optional<SimTime> tolerant) {
  if (!at) return false;
  const SimTime since = result.first_effect_at.value_or(result.fault_at.value_or(SimTime{0}));
  if (tolerant && *at > since + *tolerant) return false;
  return !result.violated_at || *at <= *result.violated_at;
}

CaseOutcome outcome_of(const CaseResult& result, std::optional<SimTime> tolerant, bool has_fault,
                       bool same_traffic) {
  if (has_fault && !result.first_effect_at) return CaseOutcome::kNotFired;
  const auto& host = result.detected_by_host;
  const auto& drive = result.detected_by_drive;
  if (in_time(host, result, tolerant)) return CaseOutcome::kDetectedByHost;
  if (in_time(drive, result, tolerant)) return CaseOutcome::kDetectedByDrive;
  if (host || drive) return CaseOutcome::kLate;
  if (result.violated_at) return CaseOutcome::kSilentlyWrong;
  return same_traffic ? CaseOutcome::kNoEffect : CaseOutcome::kTolerated;
}

/// A run in which all that is expected held, and nobody noticed anything: what a case without a
/// fault is measured by, whose cause is what else differs from case to case.
SeenRun flawless(const CaseGroup& group, SeenRun run) {
  const Watched& watched = group.watched;
  for (std::size_t n = 0; n < group.order.size(); ++n) {
    const bool own = n < watched.own;
    const bool fires_by_failing = !own && n >= watched.own + watched.drive &&
                                  group.fires_by_failing[n - watched.own - watched.drive];
    run.verdict.expectations[group.order[n]].status =
        own || fires_by_failing ? Status::kPassed : Status::kFailed;
  }
  run.host.reset();
  return run;
}

/// The first that the host says because of the fault; null: nothing. In real time no two runs say
/// the same at the same instant: there it means nothing whenever the other has it.
const HostNotice* noticed_by_host(const SeenRun& without, const HostEnd& host,
                                  const CaseResult& result) {
  using std::chrono::microseconds;  // in which hosts' times are
  const SimTime since = std::chrono::floor<microseconds>(result.first_effect_at.value_or(0ns));
  for (const HostNotice& one : host.notices) {
    const auto says_it = [&](const HostNotice& other) {
      return other.gist == one.gist && (result.real_time || other.at <= one.at);
    };
    const bool anyway = without.host && std::ranges::any_of(without.host->notices, says_it);
    if (one.at >= since && !anyway) return &one;
  }
  return nullptr;
}

void judge_host(const SeenRun& without, const HostEnd& host, CaseResult& result) {
  result.note = host.note;
  result.said = host.said;
  const HostNotice* const notice = noticed_by_host(without, host, result);
  if (notice == nullptr) return;
  take_earlier(result.detected_by_host, notice->at);
  if (notice->rule == 0) return;
  result.note += "; line " + std::to_string(notice->rule) + " of [detect]";
  result.said = notice->text;
}

/// Where the host program came to no end of its own, that is the outcome; but not when the fault
/// had no effect, nor when it is so without the fault.
void judge_end(const SeenRun& without, const HostEnd& host, bool has_fault, CaseResult& result) {
  if (without.host && without.host->kind != HostEnd::Kind::kExited) {
    result.outcome = CaseOutcome::kNotFired;
    result.note = "without the fault too: " + without.host->note;
    result.said = without.host->said;
    return;
  }
  if (host.kind == HostEnd::Kind::kExited || (has_fault && !result.first_effect_at)) return;
  result.outcome = host.kind == HostEnd::Kind::kHung ? CaseOutcome::kHang : CaseOutcome::kCrash;
}

}  // namespace

void judge_case(const CaseGroup& group, const SeenRun& reference, const SeenRun& with,
                std::optional<SimTime> tolerant, CaseResult& result) {
  const PlannedFault* const fault = fault_of_case(reference.verdict, with.verdict);
  const SeenRun without = fault != nullptr ? reference : flawless(group, reference);
  const auto before = in_order(group, without.verdict);
  const auto after = in_order(group, with.verdict);
  if (fault != nullptr) {
    result.fault_at = fault->report.evidence.began_at;
    result.first_effect_at = fault->report.evidence.first_effect_at;
  }
  judge_own(group, before, after, result);
  const std::size_t drives = group.watched.own + group.watched.drive;
  for (std::size_t n = group.watched.own; n < drives; ++n) {
    take_earlier(result.detected_by_drive, noticed(*before[n], *after[n], false));
  }
  for (std::size_t n = 0; n < group.watched.host; ++n) {
    take_earlier(result.detected_by_host,
                 noticed(*before[drives + n], *after[drives + n], group.fires_by_failing[n]));
  }
  if (with.verdict.invalid.size() > without.verdict.invalid.size() && result.first_effect_at) {
    result.note = with.verdict.invalid.back();
  }
  if (with.host) judge_host(without, *with.host, result);
  const bool same = fault != nullptr && without.heard == with.heard;
  result.outcome = outcome_of(result, tolerant, fault != nullptr, same);
  if (with.host) judge_end(without, *with.host, fault != nullptr, result);
}

}  // namespace lk::emulator
