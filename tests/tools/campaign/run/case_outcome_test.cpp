// From what was seen of a case to its outcome: verdicts by hand.

#include "tools/campaign/run/case_outcome.hpp"

#include <gtest/gtest.h>

#include <numeric>

namespace lk::emulator {
namespace case_outcome_test {

using namespace std::chrono_literals;
using Status = ExpectationResult::Status;
using At = std::optional<SimTime>;

/// What became of one expectation: held, failed at a time, or still open.
ExpectationResult held(At at = 5s) { return {Status::kPassed, "expected", "", "", at, at, {}}; }
ExpectationResult failed(SimTime at, const std::string& says = "") {
  return {Status::kFailed, "expected", "", says, at, at, {}};
}
/// What is watched, in the order of the scenario's expectations, the drive's, the host's.
ExpectationResult never() { return {Status::kFailed, "", "", "", std::nullopt, 5s, {}}; }

/// What is seen of a scenario with two expectations, one error to be watched, and two rules of a
/// host: a reply that comes about, and an answer that fails to.
struct Seen {
  ExpectationResult first = held();
  ExpectationResult second = held();
  ExpectationResult error = never();
  ExpectationResult reply = never();
  ExpectationResult answered = held();
  std::uint64_t heard = 1;
  bool fault = false;
  At effect;
  std::vector<std::string> own_faults = {};

  SeenRun seen() const {
    SeenRun run;
    run.heard = heard;
    run.verdict.expectations = {first, second, error, reply, answered};
    for (const std::string& name : own_faults) run.verdict.faults.push_back(named(name, 100ms));
    if (fault) run.verdict.faults.push_back(named("fault", effect));
    return run;
  }
  static PlannedFault named(const std::string& name, At effect) {
    PlannedFault planned;
    planned.bus = "vcan0";
    planned.report.fault.name = name;
    planned.report.evidence.began_at = 1s;
    planned.report.evidence.first_effect_at = effect;
    planned.report.evidence.effects = effect ? 1 : 0;
    return planned;
  }
};

CaseGroup group_of_run() {
  CaseGroup group;
  group.watched = {2, 1, 2};
  group.order = {0, 1, 2, 3, 4};
  group.hazardous = {true, true};
  group.fires_by_failing = {false, true};
  return group;
}

CaseResult judged(const Seen& with, const Seen& without = {}, const HostEnd* host = nullptr,
                  const CaseGroup& group = group_of_run()) {
  CaseResult result;
  judge_case(group, without.seen(), with.seen(), 200ms, host, result);
  return result;
}

/// A case whose fault has an effect at 1.1 s, which hosts hear of.
Seen effective() {
  Seen run;
  run.fault = true;
  run.effect = 1100ms;
  run.heard = 2;
  return run;
}

TEST(Outcome, IsTheFirstThatFits) {
  struct Case {
    const char* what;
    void (*change)(Seen&);
    CaseOutcome outcome;
  };
  const Case cases[] = {
      {"no effect, whatever fails", [](Seen& r) { r.effect.reset(), r.first = failed(2s); },
       CaseOutcome::kNotFired},
      {"the same frames", [](Seen& r) { r.heard = 1; }, CaseOutcome::kNoEffect},
      {"other frames", [](Seen&) {}, CaseOutcome::kTolerated},
      {"an error", [](Seen& r) { r.error = held(1200ms); }, CaseOutcome::kDetectedByDrive},
      {"an error, and nobody hears of it", [](Seen& r) { r.error = held(1200ms), r.heard = 1; },
       CaseOutcome::kDetectedByDrive},
      {"a reply", [](Seen& r) { r.reply = held(1200ms); }, CaseOutcome::kDetectedByHost},
      {"no answer", [](Seen& r) { r.answered = failed(1200ms); }, CaseOutcome::kDetectedByHost},
      {"both in time", [](Seen& r) { r.error = held(1150ms), r.reply = held(1200ms); },
       CaseOutcome::kDetectedByHost},
      {"the drive in time, the host late",
       [](Seen& r) { r.error = held(1150ms), r.reply = held(2s); }, CaseOutcome::kDetectedByDrive},
      {"at the end of the tolerant time", [](Seen& r) { r.error = held(1300ms); },
       CaseOutcome::kDetectedByDrive},
      {"after it", [](Seen& r) { r.error = held(1300ms + 1ns); }, CaseOutcome::kLate},
      {"with the hazard", [](Seen& r) { r.reply = held(1200ms), r.first = failed(1200ms); },
       CaseOutcome::kDetectedByHost},
      {"after the hazard", [](Seen& r) { r.reply = held(1200ms), r.first = failed(1200ms - 1ns); },
       CaseOutcome::kLate},
      {"after the first of two hazards",
       [](Seen& r) { r.reply = held(1200ms), r.first = failed(1250ms), r.second = failed(1150ms); },
       CaseOutcome::kLate},
      {"a hazard alone", [](Seen& r) { r.second = failed(2s); }, CaseOutcome::kSilentlyWrong},
      {"a hazard, and nobody hears of it", [](Seen& r) { r.second = failed(2s), r.heard = 1; },
       CaseOutcome::kSilentlyWrong},
  };
  for (const Case& c : cases) {
    Seen run = effective();
    c.change(run);
    EXPECT_EQ(judged(run).outcome, c.outcome) << c.what << ": " << to_string(judged(run).outcome);
  }
}

TEST(Outcome, SaysWhenAndWhat) {
  Seen run = effective();
  run.first = failed(1400ms, "the arm stands");
  run.second = failed(1300ms);
  run.error = held(1350ms);
  run.reply = held(1500ms);
  run.answered = failed(1450ms);
  const CaseResult result = judged(run);
  EXPECT_EQ(result.fault_at, 1s);
  EXPECT_EQ(result.first_effect_at, 1100ms);
  EXPECT_EQ(result.detected_by_drive, 1350ms);
  EXPECT_EQ(result.detected_by_host, 1450ms);
  EXPECT_EQ(result.violated_at, 1300ms);
  EXPECT_EQ(result.violated, "expected");
  run.second = held();
  EXPECT_EQ(judged(run).violated, "the arm stands");
}

TEST(Outcome, WhatFailsAnywayDoesNotCount) {
  Seen without;
  without.first = failed(500ms);
  Seen run = effective();
  run.first = failed(1200ms);
  EXPECT_EQ(judged(run, without).outcome, CaseOutcome::kTolerated);
  EXPECT_EQ(judged(run, without).violated_at, std::nullopt);
  run.second = failed(2s);
  EXPECT_EQ(judged(run, without).outcome, CaseOutcome::kSilentlyWrong);
}

TEST(Outcome, WhatIsNoHazardDoesNotCount) {
  CaseGroup group = group_of_run();
  group.hazardous = {false, true};
  Seen run = effective();
  run.first = failed(1200ms);
  EXPECT_EQ(judged(run, {}, nullptr, group).outcome, CaseOutcome::kTolerated);
}

TEST(Outcome, WhatFiresEarlierWithoutTheFaultIsNoDetection) {
  for (const bool earlier : {true, false}) {
    const SimTime anyway = earlier ? SimTime{900ms} : SimTime{2s};
    const SimTime at = earlier ? SimTime{1150ms} : SimTime{1200ms};
    const CaseOutcome drive = earlier ? CaseOutcome::kTolerated : CaseOutcome::kDetectedByDrive;
    const CaseOutcome host = earlier ? CaseOutcome::kTolerated : CaseOutcome::kDetectedByHost;
    Seen without, run = effective();
    without.error = held(anyway), run.error = held(at);
    EXPECT_EQ(judged(run, without).outcome, drive);
    without = {}, run = effective();
    without.reply = held(anyway), run.reply = held(at);
    EXPECT_EQ(judged(run, without).outcome, host);
    without = {}, run = effective();
    without.answered = failed(anyway), run.answered = failed(at);
    EXPECT_EQ(judged(run, without).outcome, host);
  }
  Seen without, run = effective();
  without.error = held(1150ms), run.error = held(1150ms);  // at the same time: not because of it
  EXPECT_EQ(judged(run, without).outcome, CaseOutcome::kTolerated);
}

TEST(Outcome, FindsTheCasesFaultBehindThoseOfTheScenario) {
  Seen without;
  without.own_faults = {"a", "b"};
  Seen run = effective();
  run.own_faults = without.own_faults;
  EXPECT_EQ(judged(run, without).first_effect_at, 1100ms);
  run.effect.reset();
  EXPECT_EQ(judged(run, without).outcome, CaseOutcome::kNotFired);
}

// A fault of the first of two buses stands before what the scenario plans on the second.
TEST(Outcome, FindsTheCasesFaultBeforeThoseOfAnotherBus) {
  SeenRun without = Seen{}.seen();
  without.verdict.faults = {Seen::named("fault", 100ms)};
  without.verdict.faults[0].bus = "vcan1";
  SeenRun with = without;
  with.heard = 2;
  with.verdict.faults.insert(with.verdict.faults.begin(), Seen::named("fault", 1100ms));
  CaseResult result;
  judge_case(group_of_run(), without, with, 200ms, nullptr, result);
  EXPECT_EQ(result.first_effect_at, 1100ms);
}

TEST(Outcome, WithoutATolerantTimeOnlyTheHazardEndsIt) {
  Seen run = effective();
  run.error = held(4s);
  CaseResult result;
  judge_case(group_of_run(), Seen{}.seen(), run.seen(), std::nullopt, nullptr, result);
  EXPECT_EQ(result.outcome, CaseOutcome::kDetectedByDrive);
}

TEST(Outcome, APlanWithoutAFaultIsJudgedFromItsBeginning) {
  Seen run;  // its loads, its supply or its host's settings are otherwise
  EXPECT_EQ(judged(run).outcome, CaseOutcome::kNoEffect);
  run.heard = 2;
  EXPECT_EQ(judged(run).outcome, CaseOutcome::kTolerated);
  run.first = failed(1s);
  EXPECT_EQ(judged(run).outcome, CaseOutcome::kSilentlyWrong);
}

// Buses come one after the other in a verdict, and not as the scenario has them.
TEST(Outcome, TakesExpectationsInTheOrderOfTheScenario) {
  CaseGroup group = group_of_run();
  group.order = {4, 3, 2, 1, 0};
  Seen run = effective();
  SeenRun with = run.seen();
  SeenRun without = Seen{}.seen();
  with.verdict.expectations[3] = failed(2s, "second");
  for (SeenRun* seen : {&with, &without}) {
    auto& all = seen->verdict.expectations;
    all[4] = held();
    if (seen == &without) all[3] = held();
    all[2] = never();
    all[1] = never();
    all[0] = held();
  }
  CaseResult result;
  judge_case(group, without, with, 200ms, nullptr, result);
  EXPECT_EQ(result.violated, "second");
  EXPECT_EQ(result.outcome, CaseOutcome::kSilentlyWrong);
}

TEST(Outcome, TheLeastMarginOfWhatHoldsWithoutTheFault) {
  Seen without, run = effective();
  run.first.margin = 0.25;
  run.second.margin = 0.5;
  EXPECT_EQ(judged(run, without).margin, 0.25);
  without.first = failed(1s);
  EXPECT_EQ(judged(run, without).margin, 0.5);
  run.second = failed(2s);
  run.second.margin = -0.5;
  EXPECT_EQ(judged(run, without).margin, -0.5);
}

TEST(Outcome, OfAHostProgram) {
  const HostEnd fine{HostEnd::Kind::kExited, std::nullopt, "exit status 0"};
  const HostEnd noticed{HostEnd::Kind::kExited, 1200ms, "exit status 3"};
  const HostEnd late{HostEnd::Kind::kExited, 2s, "exit status 3"};
  const HostEnd died{HostEnd::Kind::kDied, std::nullopt, "killed by SIGSEGV"};
  const HostEnd hung{HostEnd::Kind::kHung, 1200ms, "did not end in time"};
  EXPECT_EQ(judged(effective(), {}, &fine).outcome, CaseOutcome::kTolerated);
  EXPECT_EQ(judged(effective(), {}, &noticed).outcome, CaseOutcome::kDetectedByHost);
  EXPECT_EQ(judged(effective(), {}, &noticed).note, "exit status 3");
  EXPECT_EQ(judged(effective(), {}, &late).outcome, CaseOutcome::kLate);
  EXPECT_EQ(judged(effective(), {}, &died).outcome, CaseOutcome::kCrash);
  EXPECT_EQ(judged(effective(), {}, &hung).outcome, CaseOutcome::kHang);
  Seen unfired = effective();
  unfired.effect.reset();
  EXPECT_EQ(judged(unfired, {}, &died).outcome, CaseOutcome::kCrash);
  EXPECT_EQ(judged(unfired, {}, &hung).outcome, CaseOutcome::kHang);
}

}  // namespace case_outcome_test
}  // namespace lk::emulator
