// Verdicts on states and frames, including limits of ranges and times.

#include "emulator/core/scenario/judge.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "emulator/core/scenario/scenario_run.hpp"
#include "tests/support/test_bus.hpp"

namespace lk::emulator {
namespace judge_test {

constexpr double kInf = std::numeric_limits<double>::infinity();

using namespace std::chrono_literals;
using Status = ExpectationResult::Status;
using Kind = Period::Kind;

Period at(SimTime when) { return {Kind::kAt, 0ns, when}; }
Period by(SimTime when, SimTime from = 0ns) { return {Kind::kBy, from, when}; }
Period throughout(SimTime from, SimTime to) { return {Kind::kThroughout, from, to}; }

SignalWithin within(const char* name, double min, double max) {
  return {find_signal(name), {min, max}};
}

/// A drive at 45° for a second. At 0.5 s a push turns its shaft by 90° and a host switches it off.
ExpectationResult outcome_of(const decltype(Expectation::what)& what, Period when) {
  Scenario scenario;
  scenario.robot = {test::bus_config({1})};
  scenario.robot[0].events = {{500ms, {1, TurnShaft{90}}, std::nullopt}};
  scenario.duration = 1s;
  scenario.sends = {{0, 500ms, test::frame("141#8000000000000000")}};
  scenario.expectations = {{0, 1, what, when, ""}};
  ScenarioRun run(scenario);
  run.advance_to(1s);
  return run.verdict().expectations.at(0);
}

Status status_of(const decltype(Expectation::what)& what, Period when) {
  return outcome_of(what, when).status;
}

TEST(Judge, BoundsArePartOfTheRange) {
  EXPECT_EQ(status_of(within("alive", 1, 1), at(0ns)), Status::kPassed);
  EXPECT_EQ(status_of(within("alive", 1, kInf), at(1s)), Status::kPassed);
  EXPECT_EQ(status_of(within("alive", -kInf, 1), at(1s)), Status::kPassed);
  EXPECT_EQ(status_of(within("alive", 1.001, kInf), at(1s)), Status::kFailed);
  EXPECT_EQ(status_of(within("alive", -kInf, 0.999), at(1s)), Status::kFailed);
}

TEST(Judge, AnInstantIsLookedAtAfterTheEventsOfThatInstant) {
  EXPECT_EQ(status_of(within("true_angle_deg", 44, 46), at(500ms - 1ns)), Status::kPassed);
  EXPECT_EQ(status_of(within("true_angle_deg", 134, 136), at(500ms)), Status::kPassed);
  EXPECT_EQ(status_of(within("true_angle_deg", 44, 46), at(500ms)), Status::kFailed);
}

TEST(Judge, ByATimeNeedsItOnceUpToThen) {
  EXPECT_EQ(status_of(within("true_angle_deg", 134, 136), by(500ms)), Status::kPassed);
  EXPECT_EQ(status_of(within("true_angle_deg", 134, 136), by(499ms)), Status::kFailed);
  // States before `from` do not count.
  EXPECT_EQ(status_of(within("true_angle_deg", 44, 46), by(1s)), Status::kPassed);
  EXPECT_EQ(status_of(within("true_angle_deg", 44, 46), by(1s, 500ms)), Status::kFailed);
  EXPECT_EQ(status_of(within("true_angle_deg", 44, 46), by(1s, 499ms)), Status::kPassed);
}

TEST(Judge, ThroughoutNeedsItAtEveryLook) {
  EXPECT_EQ(status_of(within("true_angle_deg", 44, 46), throughout(0ns, 499ms)), Status::kPassed);
  EXPECT_EQ(status_of(within("true_angle_deg", 44, 46), throughout(0ns, 500ms)), Status::kFailed);
  EXPECT_EQ(status_of(within("true_angle_deg", 134, 136), throughout(500ms, 1s)), Status::kPassed);
  EXPECT_EQ(status_of(within("true_angle_deg", 134, 136), throughout(499ms, 1s)), Status::kFailed);
  // Its end is evaluated even between two samples.
  EXPECT_EQ(status_of(within("true_angle_deg", 44, 46), throughout(400ms + 500us, 500ms)),
            Status::kFailed);
}

TEST(Judge, StatesAndErrorsAreLookedAtAlike) {
  // The host's frame of 0.5 s is in transit at that instant, and received right after it.
  EXPECT_EQ(status_of(StateIs{RunState::kRunning}, throughout(0ns, 500ms)), Status::kPassed);
  EXPECT_EQ(status_of(StateIs{RunState::kRunning}, throughout(0ns, 501ms)), Status::kFailed);
  EXPECT_EQ(status_of(StateIs{RunState::kOff}, by(501ms)), Status::kPassed);
  EXPECT_EQ(status_of(within("bridge_on", 1, 1), throughout(0ns, 500ms)), Status::kPassed);
  EXPECT_EQ(status_of(within("bridge_on", 0, 0), throughout(501ms, 1s)), Status::kPassed);
  EXPECT_EQ(status_of(StateIs{RunState::kStopped}, by(1s)), Status::kFailed);
  EXPECT_EQ(status_of(ErrorIs{{model::Error::kStall}, false}, throughout(0ns, 1s)),
            Status::kPassed);
  EXPECT_EQ(status_of(ErrorIs{{model::Error::kStall}, true}, by(1s)), Status::kFailed);
}

/// docs/reference/protocol.md §6: a protection that trips switches the bridge off, without a host.
TEST(Judge, ADriveThatTrippedIsOff) {
  Scenario scenario;
  scenario.robot = {test::bus_config({1})};
  scenario.robot[0].servos[0].rom.protections[0] = {true, 7.0, 0.5, 0.001};  // under-voltage
  scenario.robot[0].events = {{500ms, {1, SupplyVoltage{6.0, 0ns}}, std::nullopt}};
  scenario.duration = 1s;
  scenario.expectations = {
      {0, 1, StateIs{RunState::kRunning}, throughout(0ns, 500ms), ""},
      {0, 1, ErrorIs{model::Error::kUnderVoltage, true}, throughout(600ms, 1s), ""},
      {0, 1, StateIs{RunState::kOff}, throughout(600ms, 1s), ""}};
  ScenarioRun run(scenario);
  run.advance_to(1s);
  ASSERT_EQ(run.verdict().expectations.size(), scenario.expectations.size());
  for (const ExpectationResult& result : run.verdict().expectations) {
    EXPECT_EQ(result.status, Status::kPassed) << result.expected << ": " << result.measured;
  }
}

TEST(Judge, ADriveWithoutPowerIsInNoState) {
  Scenario scenario;
  scenario.robot = {test::powered_bus({1})};
  scenario.robot[0].events = {{0ns, {1, PowerOff{}}, std::nullopt}};
  scenario.duration = 2s;
  for (const RunState state : {RunState::kOff, RunState::kStopped, RunState::kRunning}) {
    scenario.expectations.push_back({0, 1, StateIs{state}, at(1s), ""});
  }
  ScenarioRun run(scenario);
  run.advance_to(2s);
  ASSERT_EQ(run.verdict().expectations.size(), scenario.expectations.size());
  for (const ExpectationResult& result : run.verdict().expectations) {
    EXPECT_EQ(result.status, Status::kFailed);
    EXPECT_NE(result.measured.find("no power"), std::string::npos) << result.measured;
  }
}

TEST(Judge, AStateIsCloserThanNone) {
  Scenario scenario;
  scenario.robot = {test::powered_bus({1})};  // boots in 50 ms
  scenario.robot[0].events = {{0ns, {1, PowerOff{}}, std::nullopt},
                              {500ms, {1, PowerOn{}}, std::nullopt}};
  scenario.duration = 1s;
  scenario.expectations = {{0, 1, StateIs{RunState::kOff}, by(400ms), ""},
                           {0, 1, StateIs{RunState::kOff}, by(1s), ""}};
  ScenarioRun run(scenario);
  run.advance_to(1s);
  const auto results = run.verdict().expectations;
  EXPECT_EQ(results.at(0).measured, "never off by 0.4 s, no power at 0 s");
  EXPECT_EQ(results.at(1).status, Status::kFailed);
  EXPECT_EQ(results.at(1).measured.substr(0, 30), "never off by 1 s, running at 0");
  ASSERT_TRUE(results.at(1).at);
  EXPECT_GE(*results.at(1).at, 550ms);
  EXPECT_LE(*results.at(1).at, 560ms);
}

TEST(Judge, WhatIsNoNumberIsWithinNoRange) {
  Scenario scenario;
  scenario.robot = {test::bus_config({1})};
  // No file or push can cause this.
  scenario.robot[0].servos[0].profile.drive.supply.v_source = std::nan("");
  scenario.duration = 2s;
  scenario.expectations = {{0, 1, within("true_voltage_V", -kInf, kInf), throughout(0ns, 2s), ""}};
  ScenarioRun run(scenario);
  run.advance_to(2s);
  ASSERT_FALSE(std::isfinite(run.bus(0).truth(1).v_bus));
  EXPECT_EQ(run.verdict().expectations.at(0).status, Status::kFailed);
  EXPECT_EQ(run.verdict().outcome, Outcome::kInvalid);
}

TEST(Judge, SaysWhatWasMeasuredAndWhen) {
  const auto early = outcome_of(within("alive", 2, 3), by(1s));
  EXPECT_EQ(early.expected, "test drive 1: alive 2 to 3 by 1 s");
  EXPECT_EQ(early.measured, "closest was 1 at 0 s");
  const auto off = outcome_of(StateIs{RunState::kRunning}, throughout(0ns, 1s));
  EXPECT_EQ(off.measured, "off at 0.501 s");
  EXPECT_EQ(off.at, 501ms);
  EXPECT_EQ(outcome_of(within("alive", 0, kInf), throughout(0ns, 1s)).measured, "1 to 1");
  EXPECT_EQ(outcome_of(ErrorIs{model::Error::kStall, true}, at(1s)).measured, "not set at 1 s");
}

TEST(Judge, SaysOfWhatDidNotComeAboutUntilWhenItWasLookedFor) {
  EXPECT_EQ(outcome_of(ErrorIs{model::Error::kStall, true}, by(750ms)).measured,
            "never set by 0.75 s");
  EXPECT_EQ(outcome_of(StateIs{RunState::kStopped}, by(400ms)).measured,
            "never stopped by 0.4 s, running at 0 s");
  EXPECT_EQ(outcome_of(ErrorIs{model::Error::kStall, false}, by(750ms)).measured, "not set at 0 s");
  const Bus bus{test::bus_config({1})};
  const Expectation stalls{0, 1, ErrorIs{model::Error::kStall, true}, by(1s), ""};
  Judge judge(test::bus_config({1}), {stalls}, 0, 0ns);
  judge.sample(bus);
  EXPECT_EQ(judge.results(0ns).at(0).measured, "not set so far");
}

/// A judge of one drive with a manual wire.
struct Ear {
  explicit Ear(const Replies& replies, Period when = throughout(0ns, 10s), SimTime start = 0ns)
      : judge(test::bus_config({1, 2}), {{0, 1, replies, when, ""}}, 0, start) {}
  void query(SimTime when, const char* text) { judge.on_query({when, test::frame(text)}, bus); }
  void reply(SimTime when, const char* text) { judge.on_reply({when, test::frame(text)}); }
  Status status(SimTime now = 10s) const { return judge.results(now).at(0).status; }
  Bus bus{test::bus_config({1, 2})};
  Judge judge;
};

TEST(Judge, CountsRepliesOfTheDriveAndTheCommand) {
  Replies three;
  three.command = 0x9C;
  three.min_count = three.max_count = 2;
  Ear ear(three);
  ear.reply(1s, "141#9C00000000000000");
  EXPECT_EQ(ear.status(2s), Status::kOpen);
  EXPECT_EQ(ear.status(), Status::kFailed);
  ear.reply(2s, "142#9C00000000000000");  // from another drive
  ear.reply(2s, "141#9A00000000000000");  // to another command
  ear.reply(2s, "00000141#9C00000000000000");
  EXPECT_EQ(ear.status(), Status::kFailed);
  ear.reply(3s, "141#9C00000000000000");
  EXPECT_EQ(ear.status(5s), Status::kOpen) << "a third one may come";
  EXPECT_EQ(ear.status(), Status::kPassed);
  ear.reply(4s, "141#9C00000000000000");
  EXPECT_EQ(ear.status(5s), Status::kFailed) << "one too many is one too many at once";
}

TEST(Judge, CountsRepliesWithinThePeriodItsEndsIncluded) {
  Replies one;
  one.min_count = one.max_count = 2;
  Ear ear(one, throughout(1s, 2s));
  ear.reply(1s - 1ns, "141#9C00000000000000");
  ear.reply(2s + 1ns, "141#9C00000000000000");
  EXPECT_EQ(ear.status(), Status::kFailed);
  ear.reply(1s, "141#9C00000000000000");
  ear.reply(2s, "141#9C00000000000000");
  EXPECT_EQ(ear.status(), Status::kPassed);
}

TEST(Judge, TimesCountFromTheStart) {
  Replies one;
  Ear ear(one, throughout(1s, 2s), 100s);
  ear.reply(1500ms, "141#9C00000000000000");
  EXPECT_EQ(ear.status(103s), Status::kFailed);
  ear.reply(101500ms, "141#9C00000000000000");
  EXPECT_EQ(ear.status(103s), Status::kPassed);
  EXPECT_EQ(ear.judge.results(103s).at(0).measured, "1 reply at 1.5 s");
}

TEST(Judge, NoReplyIsNone) {
  Replies none;
  none.command = 0x9C;
  none.min_count = none.max_count = 0;
  Ear ear(none);
  EXPECT_EQ(ear.status(5s), Status::kOpen);
  EXPECT_EQ(ear.status(), Status::kPassed);
  ear.reply(1s, "141#9C00000000000000");
  EXPECT_EQ(ear.status(5s), Status::kFailed);
}

TEST(Judge, TheAgeOfAReplyCountsFromTheLatestQueryWithItsCommand) {
  Replies late;
  late.command = 0x9C;
  late.age = Range{5, 6};
  Ear ear(late);
  ear.reply(0s, "141#9C00000000000000");  // without a query
  ear.query(1000ms, "141#9C00000000000000");
  ear.query(1003ms, "141#9A00000000000000");
  ear.query(1003ms, "142#9C00000000000000");
  ear.reply(1005ms - 1ns, "141#9C00000000000000");
  ear.reply(1006ms + 1ns, "141#9C00000000000000");
  EXPECT_EQ(ear.status(), Status::kFailed);
  ear.reply(1005ms, "141#9C00000000000000");
  EXPECT_EQ(ear.status(), Status::kPassed);
}

TEST(Judge, AFrameForSeveralAsksEachOfItsDrives) {
  BusConfig config = test::bus_config({});
  config.servos = {test::drive(Generation::kV236, Series::kMg, 1)};
  config.servos[0].rom.broadcast_mode = true;
  const Bus bus(config);
  const std::pair<const char*, std::uint8_t> asked[] = {{"280#0000000000000000", 0xA1},
                                                        {"281#0000000000000000", 0xA2},
                                                        {"282#0000000000000000", 0xA3},
                                                        {"288#9C009A0000000000", 0x9C}};
  for (const auto& [query, command] : asked) {
    Replies prompt;
    prompt.command = command;
    prompt.age = Range{1, 2};
    Judge judge(config, {{0, 1, prompt, throughout(0ns, 10s), ""}}, 0, 0ns);
    protocol::Frame reply = test::frame("141#0000000000000000");
    reply.data[0] = command;
    judge.on_reply({500ms, reply});  // without a query
    judge.on_query({1s, test::frame(query)}, bus);
    EXPECT_EQ(judge.results(10s).at(0).status, Status::kFailed) << query;
    judge.on_reply({1s + 1500us, reply});
    EXPECT_EQ(judge.results(10s).at(0).status, Status::kPassed) << query;
  }
}

TEST(Judge, AFrameThatADriveDoesNotListenToAsksNothing) {
  for (const bool several : {false, true}) {
    BusConfig config = test::bus_config({});
    config.servos = {test::drive(Generation::kV236, Series::kMg, 1)};
    config.servos[0].rom.broadcast_mode = several;
    const Bus bus(config);
    const char* own = several ? "280#0000000000000000" : "141#A100000000000000";
    const char* others = several ? "141#A100000000000000" : "280#0000000000000000";
    Replies slow;
    slow.command = 0xA1;
    slow.age = Range{5, 6};
    Judge judge(config, {{0, 1, slow, throughout(0ns, 10s), ""}}, 0, 0ns);
    judge.on_query({1000ms, test::frame(own)}, bus);
    judge.on_query({1004ms, test::frame(others)}, bus);
    judge.on_reply({1005ms, test::frame("141#A100000000000000")});
    EXPECT_EQ(judge.results(10s).at(0).status, Status::kPassed) << several;
  }
}

TEST(Judge, AFrameForSeveralWithoutAWordForADriveAsksItNothing) {
  BusConfig config = test::bus_config({});
  config.servos = {test::drive(Generation::kV236, Series::kMg, 9)};
  config.servos[0].rom.broadcast_mode = true;
  const Bus bus(config);
  Replies prompt;
  prompt.age = Range{0, 5};
  // 0x288 addresses drives 1 to 8; half a frame addresses none.
  for (const char* query : {"288#9A9A9A9A9A9A9A9A", "280#0000"}) {
    Judge judge(config, {{0, 9, prompt, throughout(0ns, 10s), ""}}, 0, 0ns);
    judge.on_query({1s, test::frame(query)}, bus);
    for (const char* reply : {"149#9A00000000000000", "149#A100000000000000"}) {
      judge.on_reply({1001ms, test::frame(reply)});
    }
    EXPECT_EQ(judge.results(10s).at(0).status, Status::kFailed) << query;
  }
}

/// In units of the range's width, 10°; the drive is at 45°, from 0.5 s on at 135°.
TEST(Judge, SaysHowFarItWasFromFailingAndWhenThatWasDecided) {
  constexpr double kCount = 0.02 / 10;  // a step of the encoder, 360/2^15°, plus rounding
  const auto one = [](double min, double max, Period when) {
    return outcome_of(within("true_angle_deg", min, max), when);
  };
  const ExpectationResult in_the_middle = one(40, 50, at(0ns));
  EXPECT_NEAR(in_the_middle.margin.value(), 0.5, kCount);
  EXPECT_EQ(in_the_middle.decided_at, 0ns);
  const ExpectationResult held = one(44, 54, throughout(0ns, 499ms));
  EXPECT_NEAR(held.margin.value(), 0.1, kCount);
  EXPECT_EQ(held.decided_at, 499ms);
  const ExpectationResult left = one(40, 50, throughout(0ns, 1s));
  EXPECT_NEAR(left.margin.value(), -8.5, kCount);
  EXPECT_EQ(left.decided_at, 500ms);
  // Half of the time was left.
  const ExpectationResult came = one(130, 140, by(1s));
  EXPECT_NEAR(came.margin.value(), 0.5, 1e-9);
  EXPECT_EQ(came.decided_at, 500ms);
  const ExpectationResult missed = one(130, 140, by(499ms));
  EXPECT_NEAR(missed.margin.value(), -8.5, kCount);
  EXPECT_EQ(missed.decided_at, 499ms);
  // With one bound: in multiples of it, for a bound of 0 in degrees.
  EXPECT_NEAR(one(-kInf, 90, at(0ns)).margin.value(), 0.5, kCount);
  EXPECT_NEAR(one(0, kInf, at(0ns)).margin.value(), 45, 0.02);
  // A flag has no margin.
  const ExpectationResult error = outcome_of(ErrorIs{model::Error::kStall, true}, at(1s));
  EXPECT_EQ(error.margin, std::nullopt);
  EXPECT_EQ(error.decided_at, 1s);
}

TEST(Judge, RepliesAreDecidedWhenThereAreEnoughOrTooMany) {
  const auto decided_at = [](std::uint64_t min_count, std::uint64_t max_count) {
    Replies replies;
    replies.min_count = min_count;
    replies.max_count = max_count;
    Ear ear(replies);
    for (const SimTime when : {1s, 2s, 3s}) ear.reply(when, "141#9C19000000000000");
    return ear.judge.results(10s).at(0).decided_at;
  };
  constexpr auto kAny = std::numeric_limits<std::uint64_t>::max();
  EXPECT_EQ(decided_at(2, kAny), 2s);
  EXPECT_EQ(decided_at(1, 2), 3s);
  EXPECT_EQ(decided_at(3, 3), 10s);
  EXPECT_EQ(decided_at(4, kAny), 10s);
}

TEST(Judge, ReadsWhatARepliesSays) {
  // 0x9A by the manual: 25 °C, 24.0 V in 0.1 V, under-voltage is bit 0.
  Replies error;
  error.error = WhichError{model::Error::kUnderVoltage};
  Ear set(error);
  set.reply(1s, "141#9A1900F000000000");
  EXPECT_EQ(set.status(), Status::kFailed);
  set.reply(1s, "141#9A1900F000000001");
  EXPECT_EQ(set.status(), Status::kPassed);

  Replies voltage;
  voltage.field = "voltage_V";
  voltage.range = {23.95, 24.05};
  Ear volts(voltage);
  volts.reply(1s, "141#9C19000000000000");  // contains no voltage
  volts.reply(1s, "141#9A1900EF00000000");
  EXPECT_EQ(volts.status(), Status::kFailed);
  volts.reply(1s, "141#9A1900F000000000");
  EXPECT_EQ(volts.status(), Status::kPassed);
}

}  // namespace judge_test
}  // namespace lk::emulator
