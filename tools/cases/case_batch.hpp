#pragma once

/// @file Computes the cases of a campaign. Cases with a common beginning compute it once, and eight
/// cases run side by side in the lanes of a DriveBank.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "emulator/core/scenario/scenario_run.hpp"
#include "tools/cases/case_builder.hpp"
#include "tools/cases/traffic_watch.hpp"

namespace lk::emulator {

/// A case, and what its run has shown so far.
struct CaseRun {
  const CaseRequest* request = nullptr;
  const CaseCourse* course = nullptr;
  std::vector<PlannedDirective> fault;
  TrafficWatch watch;
  std::string state, command;  // of the drive just before its fault; empty without a fault
  std::string fault_name;      // name of the fault on its bus
  Verdict verdict;
};

/// Computes cases. Not thread-safe: use one object for each thread. The result of a case does not
/// depend on other cases.
class CaseBatch {
 public:
  /// Receives JSON lines, in any order: the results of cases, or why a case is impossible.
  using Take = std::function<void(const std::string& lines)>;

  /// Runs the cases; with `check`, only builds them. Returns true if all are possible.
  bool run(std::span<const CaseRequest> requests, bool check, const Take& take);

 private:
  /// A scenario run up to some time, and the traffic until then.
  struct Start {
    ScenarioRun run;
    TrafficWatch watch;
  };
  const CaseCourse& course_of(const CaseRequest& request);
  void run_group(std::span<CaseRun> cases, const Take& take) const;
  static void run_together(std::span<CaseRun> cases, const std::vector<Start>& starts);

  CaseBuilder builder_;
  std::map<std::string, std::unique_ptr<CaseCourse>> courses_;  // by CaseRequest::group
  std::size_t course_text_ = 0;                                 // bytes of all keys of `courses_`
};

// Return results as lines of JSON (docs/reference/formats.md).

std::string results_json(std::span<const CaseRun> cases);
/// Returns drives, duration and expectations of a case that is checked but not run.
std::string possible_json(const CaseRun& one);
std::string impossible_json(std::uint64_t number, const std::string& reason);

}  // namespace lk::emulator
