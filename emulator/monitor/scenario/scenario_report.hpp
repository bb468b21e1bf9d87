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

/// "passed", "failed", "invalid".
const char* outcome_word(Outcome outcome);
/// Exit status: 0 passed, 1 failed, 3 invalid.
int exit_status(Outcome outcome);

/// Describes a planned fault: "jam of drive 1 began at 1 s, took effect at 1.001 s, …".
std::string fault_sentence(const PlannedFault& fault);

/// Returns the outcome, each expectation with its measurement, each fault with its effect, and
/// advice in `language`.
std::string report_text(const RunReport& report, bool in_colour,
                        Language language = Language::kEnglish);

}  // namespace lk::emulator
