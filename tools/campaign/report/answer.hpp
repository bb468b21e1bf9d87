#pragma once

/// @file What a campaign says, from its results.

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "tools/campaign/report/case_words.hpp"
#include "tools/campaign/report/latency_counts.hpp"
#include "tools/campaign/report/statistics.hpp"

namespace lk::emulator {

/// Gives every result, in any order, to whom it is handed.
using CaseStream = std::function<void(const std::function<void(const CaseResult&)>&)>;

using OutcomeCounts = std::array<std::uint64_t, kCaseOutcomes>;

/// How much of what was dangerous was detected in time. Dangerous are the cases that were detected,
/// in time or late, and those that were silently wrong, hung or crashed; a fault that never took
/// effect, or that was tolerated, says nothing about detection.
struct Coverage {
  std::uint64_t covered = 0;  // detected in time
  std::uint64_t dangerous = 0;
  /// Of `random` only: other samplings do not draw from the space as it was declared.
  std::optional<Interval> interval;
  std::vector<ClaimNeed> needs;  // of 90 % and of 99 %; empty where there is no interval

  /// Nothing where nothing was dangerous.
  std::optional<double> share() const;
};
Coverage coverage_of(const OutcomeCounts& outcomes, Sampling sampling);

/// The cases of one kind of fault, or of all.
struct KindAnswer {
  std::string kind;  // "jam"; empty: all
  OutcomeCounts outcomes{};
  LatencyCounts by_drive;  // from the first effect to the detection, in time or not
  LatencyCounts by_host;
  LatencyCounts detected;  // by whoever was first
  Coverage coverage;

  std::uint64_t cases() const;
  std::uint64_t failures() const;
  std::uint64_t count(CaseOutcome outcome) const {
    return outcomes.at(static_cast<std::size_t>(outcome));
  }
};

/// Where faults met the drive: kind of fault × run state × latest command. A case whose fault never
/// took effect has met nothing. Nothing is known of cases with a host program: theirs is empty.
struct Space {
  struct Cell {
    std::uint64_t cases = 0;
    std::uint64_t failures = 0;
  };
  std::vector<std::string> kinds;     // of the plan, and all that were met
  std::vector<std::string> states;    // the drive's run states, and all that were met
  std::vector<std::string> commands;  // that were met
  std::map<std::tuple<std::string, std::string, std::string>, Cell> cells;  // that were met

  Cell at(const std::string& kind, const std::string& state, const std::string& command) const;
  /// Combinations of what is known that no case has met.
  std::uint64_t holes() const { return size() - cells.size(); }
  std::uint64_t size() const { return kinds.size() * states.size() * commands.size(); }
};

/// Of a kind of fault and an outcome: the case with the least severity and the shortest time that
/// still has it.
struct SmallestCase {
  std::string kind;
  CaseOutcome outcome = CaseOutcome::kLate;
  CaseResult result;
  std::string svg;      // its picture; empty: none
  std::string command;  // that runs it again
};

struct Answer {
  /// Failures of each outcome that are kept; of the others there are counts.
  static constexpr std::size_t kMostOfOutcome = 25'000;

  CampaignHead head;
  std::string plan_file;      // as it is called in commands: "plans/every_fault.toml"
  std::string store_file;     // which has the values of the cases of `adaptive`; empty: not known
  std::uint64_t missing = 0;  // cases of the plan that have no result
  KindAnswer all;
  std::vector<KindAnswer> kinds;  // in the plan's order
  Space space;
  std::vector<CaseResult> residual;  // late, silently wrong, hang, crash; by number
  std::uint64_t residual_left_out = 0;
  std::uint64_t real_time = 0;  // cases of this clock
  std::uint64_t flipped = 0;    // of these, those whose runs differ in their outcome
  std::vector<SmallestCase> smallest = {};

  /// "lk-emu campaign plans/every_fault.toml --case 4711".
  std::string command_of(std::uint64_t number) const;
};

/// `plan_file` is for commands; empty: as the head says, or else the plan's name and ".toml".
Answer answer_of(const CampaignHead& head, const CaseStream& results, std::string plan_file = "");

}  // namespace lk::emulator
