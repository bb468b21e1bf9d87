#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "emulator/core/scenario/judge.hpp"
#include "emulator/core/scenario/scenario_run.hpp"
#include "emulator/core/sim_time.hpp"
#include "emulator/monitor/advice/advice.hpp"

namespace lk::emulator {

/// A mistake of a host on one of the buses.
struct GivenAdvice {
  std::string bus;  // interface
  Advice advice;
};

/// Results of one bus, besides the verdict.
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
  std::vector<BusAccount> accounts = {};   // one per bus; only for a live scenario

  /// Outcome of the verdict; with `strict`, advice makes it fail.
  Outcome outcome() const {
    const bool fails = strict && !advice.empty() && verdict.outcome == Outcome::kPassed;
    return fails ? Outcome::kFailed : verdict.outcome;
  }
};

/// Returns JUnit XML for CI systems: one suite per run, one case per expectation and planned fault.
/// Each advice is a case if strict, otherwise a line in system-out. There is no `hostname` and no
/// time stamp, so that two runs differ only in `time`.
std::string junit_xml(const std::vector<RunReport>& reports);

/// A progress line on standard error, shown after one second.
class Progress {
 public:
  Progress(std::string name, SimTime duration, bool wanted);
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  ~Progress();  // erases the line

  void show(SimTime now);
  double wall_s() const;

 private:
  std::string name_;
  SimTime duration_;
  bool wanted_;
  bool shown_ = false;
  std::chrono::steady_clock::time_point began_;
  std::chrono::steady_clock::time_point next_;
};

/// Returns "passed", "failed" or "invalid".
const char* outcome_word(Outcome outcome);
/// Returns the exit status of lk-emu: 0 passed, 1 failed, 3 invalid.
int exit_status(Outcome outcome);

/// Describes a planned fault: "jam of drive 1 began at 1 s, took effect at 1.001 s, …".
std::string fault_sentence(const PlannedFault& fault);

/// Returns a text for the terminal: the outcome, each expectation with its measurement, each fault
/// with its effect, and the advice. Only the advice is in `language`.
std::string report_text(const RunReport& report, bool in_colour,
                        Language language = Language::kEnglish);

}  // namespace lk::emulator
