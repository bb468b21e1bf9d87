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
  std::optional<HostEnd> host = std::nullopt;

  SeenRun seen() const {
    SeenRun run;
    run.heard = heard;
    run.host = host;
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

/// A line of a host that the second expression is for.
HostNotice notice(SimTime at, const std::string& gist = "alarm") { return {at, gist, 2, gist}; }

CaseGroup group_of_run() {
  CaseGroup group;
  group.watched = {2, 1, 2};
  group.order = {0, 1, 2, 3, 4};
  group.hazardous = {true, true};
  group.fires_by_failing = {false, true};
  return group;
}

CaseResult judged(const Seen& with, const Seen& without = {},
                  const CaseGroup& group = group_of_run()) {
  CaseResult result;
  judge_case(group, without.seen(), with.seen(), 200ms, result);
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
  EXPECT_EQ(judged(run, {}, group).outcome, CaseOutcome::kTolerated);
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
  judge_case(group_of_run(), without, with, 200ms, result);
  EXPECT_EQ(result.first_effect_at, 1100ms);
}

TEST(Outcome, WithoutATolerantTimeOnlyTheHazardEndsIt) {
  Seen run = effective();
  run.error = held(4s);
  CaseResult result;
  judge_case(group_of_run(), Seen{}.seen(), run.seen(), std::nullopt, result);
  EXPECT_EQ(result.outcome, CaseOutcome::kDetectedByDrive);
}

// Its loads, its supply or its host's settings are otherwise; there is nothing to compare it with
// but itself, and it did not notice or fail because of a fault.
TEST(Outcome, APlanWithoutAFaultIsJudgedByItself) {
  Seen run;
  EXPECT_EQ(judged(run, run).outcome, CaseOutcome::kTolerated);
  run.error = held(150ms);
  EXPECT_EQ(judged(run, run).outcome, CaseOutcome::kDetectedByDrive);
  run.error = never(), run.first = failed(1s), run.first.margin = -0.5;
  EXPECT_EQ(judged(run, run).outcome, CaseOutcome::kSilentlyWrong);
  EXPECT_EQ(judged(run, run).margin, -0.5);
  run.answered = failed(100ms);
  EXPECT_EQ(judged(run, run).outcome, CaseOutcome::kDetectedByHost);
  run.answered = held(), run.host = HostEnd{HostEnd::Kind::kExited, {notice(100ms)}, "", ""};
  EXPECT_EQ(judged(run, run).outcome, CaseOutcome::kDetectedByHost);
  run.host->kind = HostEnd::Kind::kDied;
  EXPECT_EQ(judged(run, run).outcome, CaseOutcome::kCrash);
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
  judge_case(group, without, with, 200ms, result);
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

/// With a host that ended like this.
Seen hosted(HostEnd::Kind kind, std::vector<HostNotice> notices = {}) {
  Seen run = effective();
  run.host = HostEnd{kind, std::move(notices), "its end", "its last words"};
  return run;
}
Seen anyway(HostEnd::Kind kind, std::vector<HostNotice> notices = {}) {
  Seen run;
  run.host = HostEnd{kind, std::move(notices), "its end", "its last words"};
  return run;
}
constexpr auto kExited = HostEnd::Kind::kExited;

TEST(Outcome, OfAHostProgram) {
  const Seen well = anyway(kExited);
  EXPECT_EQ(judged(hosted(kExited), well).outcome, CaseOutcome::kTolerated);
  EXPECT_EQ(judged(hosted(kExited, {notice(1200ms)}), well).outcome, CaseOutcome::kDetectedByHost);
  EXPECT_EQ(judged(hosted(kExited, {notice(2s)}), well).outcome, CaseOutcome::kLate);
  EXPECT_EQ(judged(hosted(HostEnd::Kind::kDied), well).outcome, CaseOutcome::kCrash);
  EXPECT_EQ(judged(hosted(HostEnd::Kind::kHung), well).outcome, CaseOutcome::kHang);
}

TEST(Outcome, SaysBesidesHowTheHostEndedWhichLineTold) {
  const Seen well = anyway(kExited);
  const CaseResult line = judged(hosted(kExited, {notice(1200ms, "lost it at 7 s")}), well);
  EXPECT_EQ(line.note, "its end; line 2 of [detect]");
  EXPECT_EQ(line.said, "lost it at 7 s");
  const HostNotice status{1200ms, "exit status 3", 0, "exit status 3"};
  EXPECT_EQ(judged(hosted(kExited, {status}), well).note, "its end");
  const CaseResult died = judged(hosted(HostEnd::Kind::kDied), well);
  EXPECT_EQ(died.note, "its end");
  EXPECT_EQ(died.said, "its last words");
}

// A false alarm is no detection: it comes without the fault too, or before the fault has an effect.
TEST(Outcome, WhatAHostSaysAnywayIsNoDetection) {
  const HostNotice alarm = notice(1150ms), other = notice(1200ms, "lost");
  const Seen same = anyway(kExited, {alarm});
  EXPECT_EQ(judged(hosted(kExited, {alarm}), same).outcome, CaseOutcome::kTolerated);
  EXPECT_EQ(judged(hosted(kExited, {alarm}), same).detected_by_host, std::nullopt);
  // What it says besides counts, and so does what it says earlier.
  EXPECT_EQ(judged(hosted(kExited, {alarm, other}), same).detected_by_host, 1200ms);
  EXPECT_EQ(judged(hosted(kExited, {alarm}), anyway(kExited, {notice(3s)})).detected_by_host,
            1150ms);
  const Seen well = anyway(kExited);
  EXPECT_EQ(judged(hosted(kExited, {notice(1100ms - 1us)}), well).outcome, CaseOutcome::kTolerated);
  EXPECT_EQ(judged(hosted(kExited, {notice(1100ms)}), well).outcome, CaseOutcome::kDetectedByHost);
  Seen unfired = hosted(kExited, {alarm});
  unfired.effect.reset();
  EXPECT_EQ(judged(unfired, well).outcome, CaseOutcome::kNotFired);
}

TEST(Outcome, InRealTimeWhatAHostSaysAnywayMayComeEarlier) {
  CaseResult result;
  result.real_time = true;
  judge_case(group_of_run(), anyway(kExited, {notice(1151ms)}).seen(),
             hosted(kExited, {notice(1150ms)}).seen(), 200ms, result);
  EXPECT_EQ(result.outcome, CaseOutcome::kTolerated);
}

TEST(Outcome, AHostThatDiesOrHangsAnywayDoesNotDoSoOfTheFault) {
  for (const auto kind : {HostEnd::Kind::kDied, HostEnd::Kind::kHung}) {
    Seen unfired = hosted(kind);
    unfired.effect.reset();
    EXPECT_EQ(judged(unfired, anyway(kExited)).outcome, CaseOutcome::kNotFired);
    for (const auto with : {kExited, HostEnd::Kind::kDied, HostEnd::Kind::kHung}) {
      Seen run = hosted(with, {notice(1200ms)});
      run.first = failed(2s);
      const CaseResult result = judged(run, anyway(kind));
      EXPECT_EQ(result.outcome, CaseOutcome::kNotFired);
      EXPECT_EQ(result.note, "without the fault too: its end");
    }
  }
}

}  // namespace case_outcome_test
}  // namespace lk::emulator
