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

Scenario scenario_of(const BusConfig& bus, SimTime duration = 1s) {
  Scenario scenario;
  scenario.robot = {bus};
  scenario.duration = duration;
  return scenario;
}

std::vector<ExpectationResult> results_of(const Scenario& scenario) {
  ScenarioRun run(scenario);
  run.advance_to(scenario.duration);
  EXPECT_EQ(run.verdict().expectations.size(), scenario.expectations.size());
  return run.verdict().expectations;
}

/// A drive at 45° for a second. At 0.5 s a push turns its shaft by 90° and a host switches it off.
ExpectationResult outcome_of(const decltype(Expectation::what)& what, Period when) {
  Scenario scenario = scenario_of(test::bus_config({1}));
  scenario.robot[0].events = {{500ms, {1, TurnShaft{90}}, std::nullopt}};
  scenario.sends = {{0, 500ms, test::frame("141#8000000000000000")}};
  scenario.expectations = {{0, 1, what, when, ""}};
  return results_of(scenario).at(0);
}

SignalWithin angle(double min_deg, double max_deg) {
  return within("true_angle_deg", min_deg, max_deg);
}

// The angle of the drive before and after 0.5 s.
const SignalWithin kBefore = angle(44, 46);
const SignalWithin kAfter = angle(134, 136);

Status status_of(const decltype(Expectation::what)& what, Period when) {
  return outcome_of(what, when).status;
}

TEST(Judge, RangesIncludeTheirBounds) {
  EXPECT_EQ(status_of(within("alive", 1, 1), at(0ns)), Status::kPassed);
  EXPECT_EQ(status_of(within("alive", 1, kInf), at(1s)), Status::kPassed);
  EXPECT_EQ(status_of(within("alive", -kInf, 1), at(1s)), Status::kPassed);
  EXPECT_EQ(status_of(within("alive", 1.001, kInf), at(1s)), Status::kFailed);
  EXPECT_EQ(status_of(within("alive", -kInf, 0.999), at(1s)), Status::kFailed);
}

TEST(Judge, InstantIsSampledAfterItsEvents) {
  EXPECT_EQ(status_of(kBefore, at(500ms - 1ns)), Status::kPassed);
  EXPECT_EQ(status_of(kAfter, at(500ms)), Status::kPassed);
  EXPECT_EQ(status_of(kBefore, at(500ms)), Status::kFailed);
}

TEST(Judge, ByNeedsOneSampleInTheRange) {
  EXPECT_EQ(status_of(kAfter, by(500ms)), Status::kPassed);
  EXPECT_EQ(status_of(kAfter, by(499ms)), Status::kFailed);
  // States before `from` do not count.
  EXPECT_EQ(status_of(kBefore, by(1s)), Status::kPassed);
  EXPECT_EQ(status_of(kBefore, by(1s, 500ms)), Status::kFailed);
  EXPECT_EQ(status_of(kBefore, by(1s, 499ms)), Status::kPassed);
}

TEST(Judge, ThroughoutNeedsEverySampleInTheRange) {
  EXPECT_EQ(status_of(kBefore, throughout(0ns, 499ms)), Status::kPassed);
  EXPECT_EQ(status_of(kBefore, throughout(0ns, 500ms)), Status::kFailed);
  EXPECT_EQ(status_of(kAfter, throughout(500ms, 1s)), Status::kPassed);
  EXPECT_EQ(status_of(kAfter, throughout(499ms, 1s)), Status::kFailed);
  // Its end is evaluated even between two samples.
  EXPECT_EQ(status_of(kBefore, throughout(400ms + 500us, 500ms)), Status::kFailed);
}

TEST(Judge, StatesAndErrorsAreSampledLikeSignals) {
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
TEST(Judge, TrippedDriveIsOff) {
  Scenario scenario = scenario_of(test::bus_config({1}));
  scenario.robot[0].servos[0].rom.protections[0] = {true, 7.0, 0.5, 0.001};  // under-voltage
  scenario.robot[0].events = {{500ms, {1, SupplyVoltage{6.0, 0ns}}, std::nullopt}};
  scenario.expectations = {
      {0, 1, StateIs{RunState::kRunning}, throughout(0ns, 500ms), ""},
      {0, 1, ErrorIs{model::Error::kUnderVoltage, true}, throughout(600ms, 1s), ""},
      {0, 1, StateIs{RunState::kOff}, throughout(600ms, 1s), ""}};
  for (const ExpectationResult& result : results_of(scenario)) {
    EXPECT_EQ(result.status, Status::kPassed) << result.expected << ": " << result.measured;
  }
}

TEST(Judge, DriveWithoutPowerHasNoState) {
  Scenario scenario = scenario_of(test::powered_bus({1}), 2s);
  scenario.robot[0].events = {{0ns, {1, PowerOff{}}, std::nullopt}};
  for (const RunState state : {RunState::kOff, RunState::kStopped, RunState::kRunning}) {
    scenario.expectations.push_back({0, 1, StateIs{state}, at(1s), ""});
  }
  for (const ExpectationResult& result : results_of(scenario)) {
    EXPECT_EQ(result.status, Status::kFailed);
    EXPECT_NE(result.measured.find("no power"), std::string::npos) << result.measured;
  }
}

TEST(Judge, AnyStateIsCloserThanNone) {
  Scenario scenario = scenario_of(test::powered_bus({1}));  // boots in 50 ms
  scenario.robot[0].events = {{0ns, {1, PowerOff{}}, std::nullopt},
                              {500ms, {1, PowerOn{}}, std::nullopt}};
  scenario.expectations = {{0, 1, StateIs{RunState::kOff}, by(400ms), ""},
                           {0, 1, StateIs{RunState::kOff}, by(1s), ""}};
  const auto results = results_of(scenario);
  EXPECT_EQ(results.at(0).measured, "never off by 0.4 s, no power at 0 s");
  EXPECT_EQ(results.at(1).status, Status::kFailed);
  EXPECT_EQ(results.at(1).measured.substr(0, 30), "never off by 1 s, running at 0");
  ASSERT_TRUE(results.at(1).at);
  EXPECT_GE(*results.at(1).at, 550ms);
  EXPECT_LE(*results.at(1).at, 560ms);
}

TEST(Judge, NanIsInNoRange) {
  Scenario scenario = scenario_of(test::bus_config({1}), 2s);
  // No file or push can cause this.
  scenario.robot[0].servos[0].profile.drive.supply.v_source = std::nan("");
  scenario.expectations = {{0, 1, within("true_voltage_V", -kInf, kInf), throughout(0ns, 2s), ""}};
  ScenarioRun run(scenario);
  run.advance_to(2s);
  ASSERT_FALSE(std::isfinite(run.bus(0).truth(1).v_bus));
  EXPECT_EQ(run.verdict().expectations.at(0).status, Status::kFailed);
  EXPECT_EQ(run.verdict().outcome, Outcome::kInvalid);
}

TEST(Judge, ReportsValueAndTime) {
  const auto early = outcome_of(within("alive", 2, 3), by(1s));
  EXPECT_EQ(early.expected, "test drive 1: alive 2 to 3 by 1 s");
  EXPECT_EQ(early.measured, "closest was 1 at 0 s");
  const auto off = outcome_of(StateIs{RunState::kRunning}, throughout(0ns, 1s));
  EXPECT_EQ(off.measured, "off at 0.501 s");
  EXPECT_EQ(off.at, 501ms);
  EXPECT_EQ(outcome_of(within("alive", 0, kInf), throughout(0ns, 1s)).measured, "1 to 1");
  EXPECT_EQ(outcome_of(ErrorIs{model::Error::kStall, true}, at(1s)).measured, "not set at 1 s");
}

TEST(Judge, ReportsUntilWhenAnEventWasAwaited) {
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

/// In units of the range's width, 10°; the drive is at 45°, from 0.5 s on at 135°.
TEST(Judge, ReportsMarginAndTimeOfDecision) {
  constexpr double kCount = 0.02 / 10;  // a step of the encoder, 360/2^15°, plus rounding
  const auto one = [](double min, double max, Period when) {
    return outcome_of(angle(min, max), when);
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

}  // namespace judge_test
}  // namespace lk::emulator
