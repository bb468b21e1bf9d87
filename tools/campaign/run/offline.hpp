#pragma once

/// @file Cases whose host is the scenario itself, computed side by side from shared beginnings.

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "emulator/core/scenario/scenario_run.hpp"
#include "tools/campaign/plan/case_scenario.hpp"
#include "tools/campaign/plan/plan.hpp"
#include "tools/campaign/results/case_result.hpp"
#include "tools/campaign/run/case_outcome.hpp"
#include "tools/cases/traffic_watch.hpp"

namespace lk::emulator {

/// A case to be run.
struct CaseToRun {
  std::uint64_t number = 0;
  std::uint32_t generation = 0;
  CaseValues values;
};

/// Takes results; false: the other cases are not wanted any more.
using ResultTaker = std::function<bool(std::vector<CaseResult>)>;

/// What cases share; what comes out does not depend on it.
struct OfflineSharing {
  bool lanes = true;   // eight cases in one bank
  bool prefix = true;  // from a copy of the state before the fault
};

/// Runs cases; one for each thread. Results depend on the plan and the case alone.
class OfflineRunner {
 public:
  /// `plan` must outlive this. Throws ConfigError.
  explicit OfflineRunner(const Plan& plan, OfflineSharing sharing = {});

  /// Those of one group, and near in time, are cheapest together; results come by number. Throws
  /// ConfigError where values make no scenario.
  std::vector<CaseResult> run(std::span<const CaseToRun> cases);
  /// The same; `take` gets eight at a time, or fewer, in any order.
  void run(std::span<const CaseToRun> cases, const ResultTaker& take);

 private:
  /// A group, and what its run without a fault comes to.
  struct Group {
    CaseGroup group;
    std::optional<SeenRun> end;
  };
  /// A case on its way.
  struct Lane {
    const CaseToRun* one = nullptr;
    Group* group = nullptr;
    std::vector<PlannedDirective> fault;
    TrafficWatch watch;
    std::string state, command;  // when the fault began
    SeenRun seen;
  };
  /// A run, and what has been heard of it.
  struct Start {
    ScenarioRun run;
    TrafficWatch watch;
  };

  Group& group_of(const CaseValues& values);
  std::vector<Lane> lanes_of(std::span<const CaseToRun> cases);
  bool run_group(std::span<Lane> lanes, const ResultTaker& take);
  bool run_mixed(std::span<Lane> lanes, const ResultTaker& take);
  void run_together(std::span<Lane> lanes, const std::vector<Start>& starts) const;
  SeenRun seen_without(const Group& group, Start from) const;
  std::vector<CaseResult> judged(std::span<const Lane> lanes) const;
  CaseResult judged(const Lane& lane) const;

  const Plan& plan_;
  OfflineSharing sharing_;
  CaseScenarios scenarios_;
  std::map<std::string, std::unique_ptr<Group>> groups_;
};

}  // namespace lk::emulator
