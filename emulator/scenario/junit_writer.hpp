#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "emulator/advice/advice.hpp"
#include "emulator/core/scenario/error_watch.hpp"
#include "emulator/core/scenario/scenario_run.hpp"

namespace lk::emulator {

/// What a host did wrong on one of the buses.
struct GivenAdvice {
  std::string bus;  // interface
  Advice advice;
};

/// What else there is to know of one of the buses.
struct BusAccount {
  std::string bus;                 // interface
  SimTime start{0};                // of the scenario, in the time of the bus
  std::vector<FirstError> errors;  // since the scenario began
  std::uint64_t replies = 0;       // all that drives have said
  std::uint64_t replies_hash = 0;  // of what they have said, and when; of nothing it is 0
};

/// A scenario that has been run.
struct RunReport {
  std::string name;
  std::string about;
  std::uint64_t seed = 0;
  std::size_t drives = 0;
  SimTime simulated{0};
  double wall_s = 0;
  Verdict verdict;
  std::vector<GivenAdvice> advice = {};
  bool strict = false;                     // advice is a failure
  std::vector<std::string> warnings = {};  // about the scenario itself
  std::vector<BusAccount> accounts = {};   // of buses that are not the run's own

  /// Of the verdict and, where that is strict, the advice.
  Outcome outcome() const {
    const bool fails = strict && !advice.empty() && verdict.outcome == Outcome::kPassed;
    return fails ? Outcome::kFailed : verdict.outcome;
  }
};

/// JUnit XML as CI systems read it: a suite for each run, a case for each expectation and each
/// planned fault, and for each advice where that is strict; else advice is in system-out.
/// `hostname`s and time stamps are left out: two runs give the same but `time`.
std::string junit_xml(const std::vector<RunReport>& reports);

}  // namespace lk::emulator
