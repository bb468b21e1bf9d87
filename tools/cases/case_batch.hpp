#pragma once

/// @file Cases computed side by side from shared beginnings.

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

/// A case with all that was seen of it.
struct CaseRun {
  const CaseRequest* request = nullptr;
  const CaseCourse* course = nullptr;
  std::vector<PlannedDirective> fault;
  TrafficWatch watch;
  std::string state, command;  // of the drive when the fault began; empty without a fault
  std::string fault_name;      // on its bus
  Verdict verdict;
};

/// Computes cases; one for each thread. A result depends on its case alone.
class CaseBatch {
 public:
  /// Takes JSON lines: results, or reasons why a case is impossible. Order is free.
  using Take = std::function<void(const std::string& lines)>;

  /// `check`: builds the cases and runs none. Returns whether all were possible.
  bool run(std::span<const CaseRequest> requests, bool check, const Take& take);

 private:
  /// A run and what was heard on its buses.
  struct Start {
    ScenarioRun run;
    TrafficWatch watch;
  };
  const CaseCourse& course_of(const CaseRequest& request);
  void run_group(std::span<CaseRun> cases, const Take& take) const;
  static void run_together(std::span<CaseRun> cases, const std::vector<Start>& starts);

  CaseBuilder builder_;
  std::map<std::string, std::unique_ptr<CaseCourse>> courses_;  // by CaseRequest::group
  std::size_t course_text_ = 0;
};

// Lines of JSON (docs/reference/formats.md).

std::string results_json(std::span<const CaseRun> cases);
/// Drives, duration and expectations of a case that was only checked.
std::string possible_json(const CaseRun& one);
std::string impossible_json(std::uint64_t number, const std::string& reason);

}  // namespace lk::emulator
