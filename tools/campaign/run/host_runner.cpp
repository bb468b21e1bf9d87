#include "tools/campaign/run/host_runner.hpp"

#include <algorithm>
#include <charconv>
#include <csignal>
#include <cstring>
#include <utility>

#include "emulator/ground/start_error.hpp"
#include "emulator/ground/text.hpp"
#include "tools/campaign/hosts/run_host.hpp"

namespace lk::emulator {
namespace {

/// As much of a verdict as a case is judged by.
Verdict verdict_of(const HostVerdict& host) {
  Verdict verdict;
  for (const HostExpectation& one : host.expectations) {
    ExpectationResult result;
    result.status =
        one.passed ? ExpectationResult::Status::kPassed : ExpectationResult::Status::kFailed;
    result.says = one.says;
    result.expected = one.expected;
    result.measured = one.measured;
    result.at = result.decided_at = one.decided_at;
    result.margin = one.margin;
    verdict.expectations.push_back(std::move(result));
  }
  for (const HostFault& one : host.faults) {
    PlannedFault fault;
    fault.report.fault.name = one.name;
    fault.report.evidence.began_at = one.began_at;
    fault.report.evidence.first_effect_at = one.first_effect_at;
    fault.report.evidence.effects = one.effects;
    verdict.faults.push_back(std::move(fault));
  }
  verdict.invalid = host.invalid;
  return verdict;
}

std::string end_text(const HostRun& run) {
  switch (run.end) {
    case HostRun::End::kExit:
      return "exit status " + std::to_string(run.status);
    case HostRun::End::kSignal:
      return std::string("killed by SIG") + sigabbrev_np(run.status);
    case HostRun::End::kTimeout:
      return "did not end in time";
  }
  return "";
}

/// The last line of what it said.
std::string last_words(const HostRun& run) {
  std::string text = run.output;
  while (!text.empty() && (text.back() == '\n' || text.back() == ' ')) text.pop_back();
  return on_one_line(text.substr(text.rfind('\n') + 1));
}

HostEnd end_of(const HostRun& run, const HostSetup& setup) {
  HostEnd end;
  if (run.end == HostRun::End::kTimeout) end.kind = HostEnd::Kind::kHung;
  if (run.crashed(setup)) end.kind = HostEnd::Kind::kDied;
  end.note = end_text(run);
  if (end.kind == HostEnd::Kind::kExited) {
    end.notices = run.notices;
  } else {
    end.said = last_words(run);
  }
  return end;
}

SeenRun seen(const HostRun& run, const HostSetup& setup) {
  std::uint64_t heard = 0;
  const std::string& hash = run.verdict.replies_hash;
  std::from_chars(hash.data(), hash.data() + hash.size(), heard, 16);
  return {verdict_of(run.verdict), heard, end_of(run, setup)};
}

}  // namespace

HostSetup host_setup(const Plan& plan) {
  HostSetup setup;
  setup.command = plan.host->command;
  setup.bus = plan.host->bus;
  setup.stepped = plan.host->stepped;
  setup.timeout_s = plan.host->timeout_s;
  setup.detecting_exit_status = plan.detection.exit_status;
  setup.detecting_lines = plan.detection.lines;
  setup.directory = std::filesystem::absolute(plan.file).parent_path();
  return setup;
}

std::map<std::string, std::string> host_values(const Plan& plan, const CaseValues& values) {
  std::map<std::string, std::string> settings;
  for (std::size_t n = 0; n < values.size(); ++n) {
    const Dimension& dimension = plan.dimensions[n];
    if (dimension.target != Target::kHost || !values[n]) continue;
    settings[dimension.key] = value_text(*values[n]);
  }
  return settings;
}

std::shared_ptr<HostReferences::Reference> HostReferences::find(const std::string& key) {
  const std::scoped_lock lock(mutex_);
  auto& reference = references_[key];
  if (!reference) reference = std::make_shared<Reference>();
  return reference;
}

HostRunner::HostRunner(const Plan& plan, HostReferences& references, int stop)
    : plan_(plan),
      references_(references),
      stop_(stop),
      setup_(host_setup(plan)),
      scenarios_(plan) {}

std::vector<CaseResult> HostRunner::run(std::span<const CaseToRun> cases) {
  std::vector<CaseResult> results;
  for (const CaseToRun& one : cases) {
    auto result = run_case(one);
    if (!result) break;
    results.push_back(std::move(*result));
  }
  return results;
}

std::optional<HostRun> HostRunner::run_once(std::uint64_t number, const CaseValues& values) {
  const CaseScenarios::Keys keys = scenarios_.keys(values);
  HostCase one;
  one.number = number;
  one.scenario_toml = scenarios_.file_text(values, true);
  one.robot = keys.robot;
  one.seed = keys.seed;
  one.bitrate = keys.bitrate;
  one.generation = keys.generation;
  one.host_values = host_values(plan_, values);
  return run_host_case(setup_, one, stop_);
}

std::shared_ptr<HostReferences::Reference> HostRunner::reference_of(const CaseToRun& one) {
  const CaseValues rest = scenarios_.without_fault(one.values);
  auto reference = references_.find(key_of(rest));
  std::call_once(reference->once, [&] {
    if (const auto run = run_once(one.number, rest)) reference->run = seen(*run, setup_);
  });
  return reference->run ? reference : nullptr;
}

void HostRunner::try_without_fault(const CaseToRun& one) {
  if (kind_of(plan_, one.values) == nullptr) return;
  const auto reference = reference_of(one);
  if (!reference) return;
  const HostEnd& end = reference->run->host.value();
  if (end.kind == HostEnd::Kind::kExited) return;
  throw StartError(plan_.file.string() + ": host: even without a fault the command of case " +
                   std::to_string(one.number) + " ends like this: " + end.note +
                   (end.said.empty() ? "" : "; " + end.said));
}

std::optional<CaseResult> HostRunner::run_case(const CaseToRun& one) {
  const CaseGroup group = scenarios_.group(one.values);
  std::shared_ptr<HostReferences::Reference> reference;
  if (kind_of(plan_, one.values) != nullptr) {
    reference = reference_of(one);
    if (!reference) return std::nullopt;
  }
  const SeenRun* const without = reference ? &*reference->run : nullptr;
  std::optional<CaseResult> worst;
  std::vector<CaseOutcome> outcomes;
  double wall_s = 0;
  for (int n = 0; n < plan_.host->runs; ++n) {
    const auto run = run_once(one.number, one.values);
    if (!run) return std::nullopt;
    wall_s += run->wall_s;
    CaseResult result = judged(one, group, without, *run);
    outcomes.push_back(result.outcome);
    if (!worst || result.outcome > worst->outcome) worst = std::move(result);
  }
  worst->runs = static_cast<std::uint32_t>(outcomes.size());
  worst->flips =
      worst->runs - static_cast<std::uint32_t>(std::ranges::count(outcomes, worst->outcome));
  worst->wall_s = wall_s;
  return worst;
}

CaseResult HostRunner::judged(const CaseToRun& one, const CaseGroup& group, const SeenRun* without,
                              const HostRun& run) const {
  CaseResult result;
  result.number = one.number;
  result.generation = one.generation;
  result.values = one.values;
  result.real_time = !plan_.host->stepped;
  const SeenRun with = seen(run, setup_);
  if (without == nullptr) without = &with;
  if (with.verdict.expectations.size() != without->verdict.expectations.size()) {
    throw StartError("case " + std::to_string(one.number) +
                     ": its verdict has other expectations than the case without a fault");
  }
  judge_case(group, *without, with, plan_.head.tolerant_time, result);
  return result;
}

}  // namespace lk::emulator
