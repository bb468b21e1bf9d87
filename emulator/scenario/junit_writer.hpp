#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "emulator/advice/advice.hpp"
#include "emulator/core/scenario/error_watch.hpp"
#include "emulator/core/scenario/scenario_run.hpp"

namespace lk::emulator {

/// A mistake of a host on one of the buses.
struct GivenAdvice {
  std::string bus;  // interface
  Advice advice;
};

/// Further results of one bus.
struct BusAccount {
  std::string bus;                 // interface
  SimTime start{0};                // of the scenario, in bus time
  std::vector<FirstError> errors;  // since the scenario began
  std::uint64_t replies = 0;       // of all drives
  std::uint64_t replies_hash = 0;  // of their content and time; 0: no replies
};

/// Result of a scenario.
struct RunReport {
  std::string name;
  std::string about;
  std::uint64_t seed = 0;
  std::size_t drives = 0;
  SimTime simulated{0};
  double wall_s = 0;
  Verdict verdict;
  std::vector<GivenAdvice> advice = {};
  bool strict = false;                     // advice counts as a failure
  std::vector<std::string> warnings = {};  // about the scenario
  std::vector<BusAccount> accounts = {};   // of a live scenario's buses

  /// Outcome of the verdict; with `strict`, advice makes it fail.
  Outcome outcome() const {
    const bool fails = strict && !advice.empty() && verdict.outcome == Outcome::kPassed;
    return fails ? Outcome::kFailed : verdict.outcome;
  }
};

/// JUnit XML for CI systems: one suite per run, one case per expectation and planned fault. Advice
/// is a case if strict, otherwise in system-out. Without `hostname` and time stamps: two runs
/// differ only in `time`.
std::string junit_xml(const std::vector<RunReport>& reports);

}  // namespace lk::emulator
