#pragma once

/// @file From what was seen of a case to its outcome (docs/campaigns.md).

#include <optional>
#include <string>
#include <vector>

#include "emulator/core/scenario/scenario_run.hpp"
#include "tools/campaign/hosts/host_case.hpp"
#include "tools/campaign/plan/case_scenario.hpp"
#include "tools/campaign/results/case_result.hpp"

namespace lk::emulator {

/// How a host program ended, where there is one.
struct HostEnd {
  enum class Kind : std::uint8_t { kExited, kDied, kHung };
  Kind kind = Kind::kExited;
  std::vector<HostNotice> notices;  // HostRun
  std::string note;                 // "exit status 3", "killed by SIGSEGV"
  std::string said;                 // its last words, when it came to no end of its own
};

/// What a run of a case, or of its group without the fault, has come to.
struct SeenRun {
  Verdict verdict;
  std::uint64_t heard = 0;  // TrafficWatch
  std::optional<HostEnd> host = std::nullopt;
};

/// Fills in all of `result` that follows from the runs; its real_time must be set. `tolerant`: the
/// fault-tolerant time. In a case that has no fault `without` does not count.
void judge_case(const CaseGroup& group, const SeenRun& without, const SeenRun& with,
                std::optional<SimTime> tolerant, CaseResult& result);

}  // namespace lk::emulator
