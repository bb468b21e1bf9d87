#pragma once

/// @file Cases whose host is a program of its own.

#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tools/campaign/hosts/host_case.hpp"
#include "tools/campaign/plan/case_scenario.hpp"
#include "tools/campaign/plan/plan.hpp"
#include "tools/campaign/run/case_outcome.hpp"
#include "tools/campaign/run/offline.hpp"

namespace lk::emulator {

/// The plan's host program as the room of hosts takes it. The plan must have one.
HostSetup host_setup(const Plan& plan);
/// What a case has for {host.NAME}, by name.
std::map<std::string, std::string> host_values(const Plan& plan, const CaseValues& values);

/// What the host does without a fault, for all threads.
class HostReferences {
 public:
  struct Reference {
    std::once_flag once;
    std::optional<SeenRun> run;
  };
  std::shared_ptr<Reference> find(const std::string& key);

 private:
  std::mutex mutex_;
  std::map<std::string, std::shared_ptr<Reference>> references_;
};

/// Runs cases; one for each thread. Where the host moves the clock, results depend on plan and case
/// alone; in real time each case is run several times, and its result is the worst.
class HostRunner {
 public:
  /// `plan` and `references` must outlive this; `stop` can be read when cases are to be left.
  HostRunner(const Plan& plan, HostReferences& references, int stop);

  /// Throws StartError when the host hangs or dies in this case even without its fault.
  void try_without_fault(const CaseToRun& one);
  /// Fewer, when it is stopped. Throws StartError, ConfigError.
  std::vector<CaseResult> run(std::span<const CaseToRun> cases);

 private:
  std::optional<HostRun> run_once(std::uint64_t number, const CaseValues& values);
  /// Null when it is stopped.
  std::shared_ptr<HostReferences::Reference> reference_of(const CaseToRun& one);
  std::optional<CaseResult> run_case(const CaseToRun& one);
  /// `without`: the run without the fault; null where there is no fault.
  CaseResult judged(const CaseToRun& one, const CaseGroup& group, const SeenRun* without,
                    const HostRun& run) const;

  const Plan& plan_;
  HostReferences& references_;
  int stop_;
  HostSetup setup_;
  CaseScenarios scenarios_;
};

}  // namespace lk::emulator
