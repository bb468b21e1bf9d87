#pragma once

/// @file From what was seen of a case to its outcome (docs/campaigns.md).

#include <optional>
#include <string>
#include <vector>

#include "emulator/core/scenario/scenario_run.hpp"
#include "tools/campaign/plan/case_scenario.hpp"
#include "tools/campaign/results/case_result.hpp"

namespace lk::emulator {

/// What a run of a case, or of its group without the fault, has come to.
struct SeenRun {
  Verdict verdict;
  std::uint64_t heard = 0;  // TrafficWatch
};

/// How a host program ended, where there is one.
struct HostEnd {
  enum class Kind : std::uint8_t { kExited, kDied, kHung };
  Kind kind = Kind::kExited;
  std::optional<SimTime> noticed_at;  // a line of its output, or its exit status
  std::string note;                   // "exit status 3", "killed by SIGSEGV"
};

/// Fills in all of `result` that follows from the runs. `tolerant`: the fault-tolerant time.
void judge_case(const CaseGroup& group, const SeenRun& without, const SeenRun& with,
                std::optional<SimTime> tolerant, const HostEnd* host, CaseResult& result);

}  // namespace lk::emulator
