// Results of a whole scenario: verdict, traffic, host script.

#include "emulator/core/scenario/scenario_run.hpp"

#include <gtest/gtest.h>

#include "emulator/core/scenario/scenario_text.hpp"
#include "tests/support/faults.hpp"
#include "tests/support/test_bus.hpp"

namespace lk::emulator {
namespace scenario_run_test {

using namespace std::chrono_literals;
using Kind = Period::Kind;

Period at(SimTime when) { return {Kind::kAt, 0ns, when}; }
Period throughout(SimTime from, SimTime to) { return {Kind::kThroughout, from, to}; }

SignalWithin within(const char* name, double min, double max) {
  return {find_signal(name), {min, max}};
}

/// A second with one drive, which has power at the end.
Scenario one_drive(std::optional<TimedDirective> event = {}) {
  Scenario scenario;
  scenario.robot = {test::bus_config({1})};
  scenario.duration = 1s;
  scenario.expectations = {{0, 1, within("alive", 1, 1), at(1s), ""}};
  if (event) scenario.robot[0].events = {*event};
  return scenario;
}

TimedDirective hang_at(SimTime when) {
  return {when, {kWholeBus, SetFault{test::fault_of("hang", {}, {1})}}, std::nullopt};
}

Verdict verdict_of(const Scenario& scenario) {
  ScenarioRun run(scenario);
  run.advance_to(1s);
  return run.verdict();
}

const HostSend kQuery = {0, 500ms, test::frame("141#9C00000000000000")};

/// Invalid, not failed: the effect of the fault is unknown.
TEST(Verdict, IsInvalidIfAFaultHadNoEffect) {
  Scenario scenario = one_drive(hang_at(100ms));
  // Without queries the hang of the drive is not observable.
  EXPECT_EQ(verdict_of(scenario).outcome, Outcome::kInvalid);
  EXPECT_EQ(verdict_of(scenario).invalid,
            std::vector<std::string>{"test: fault hang began at 0.1 s and changed nothing"});
  scenario.sends = {kQuery};
  EXPECT_EQ(verdict_of(scenario).outcome, Outcome::kPassed);
  scenario.sends.clear();
  scenario.expectations[0].what = within("alive", 0, 0);
  EXPECT_EQ(verdict_of(scenario).outcome, Outcome::kInvalid);
}

TEST(Verdict, IsInvalidIfAFaultNeverBegan) {
  Scenario scenario = one_drive(hang_at(2s));
  scenario.sends = {kQuery};
  const Verdict verdict = verdict_of(scenario);
  EXPECT_EQ(verdict.outcome, Outcome::kInvalid);
  EXPECT_EQ(verdict.invalid, std::vector<std::string>{"test: fault hang never began"});
  EXPECT_FALSE(verdict.faults.at(0).report.evidence.began_at);
}

TEST(Verdict, IsInvalidIfAnEventStillWaitsForItsCondition) {
  const SignalReaches no_power{find_signal("alive"), Edge::kBelow, 0};
  const Verdict verdict =
      verdict_of(one_drive(TimedDirective{0ns, {1, TurnShaft{5}}, Condition{1, no_power}}));
  EXPECT_EQ(verdict.outcome, Outcome::kInvalid);
  EXPECT_EQ(verdict.invalid,
            std::vector<std::string>{"test: 1 events wait for a condition that never held"});
}

TEST(Verdict, IsInvalidBeforeTheEnd) {
  ScenarioRun run(one_drive());
  run.advance_to(999ms);
  EXPECT_EQ(run.verdict().outcome, Outcome::kInvalid);
  run.advance_to(1s);
  EXPECT_EQ(run.verdict().outcome, Outcome::kPassed);
}

Scenario two_busy_buses() {
  Scenario scenario;
  scenario.robot = {test::bus_config({1, 2}, 1'000'000), test::bus_config({1}, 500'000)};
  scenario.robot[1].interface = "other";
  scenario.duration = 300ms;
  scenario.sends = {{0, 0ns, test::frame("141#9C00000000000000"), 1ms, 300},
                    {1, 500us, test::frame("141#9C00000000000000"), 2ms, 100},
                    {0, 10ms, test::frame("142#A200000040420F00")}};
  scenario.expectations = {{1, 1, Replies{}, throughout(0ns, 300ms), ""},
                           {0, 2, within("speed_dps", 9000, 11000), at(300ms), ""}};
  return scenario;
}

TEST(ScenarioRun, TrafficDoesNotDependOnSlices) {
  const auto traffic_of = [](SimTime slice) {
    ScenarioRun run(two_busy_buses());
    std::vector<Traffic> traffic;
    while (run.time() < 300ms) {
      run.advance_to(std::min<SimTime>(run.time() + slice, 300ms));
      run.take_traffic(traffic);
    }
    return traffic;
  };
  const auto whole = traffic_of(300ms);
  const auto sliced = traffic_of(370us);
  // 401 queries, and a reply to each, except those still on the wire at the end.
  EXPECT_GE(whole.size(), 801U);
  EXPECT_LE(whole.size(), 802U);
  ASSERT_EQ(whole.size(), sliced.size());
  for (std::size_t n = 0; n < whole.size(); ++n) {
    EXPECT_EQ(whole[n].frame, sliced[n].frame) << n;
    EXPECT_EQ(whole[n].bus, sliced[n].bus) << n;
    if (n > 0) {
      EXPECT_LE(whole[n - 1].frame.at, whole[n].frame.at);
    }
  }
}

TEST(ScenarioRun, JudgesEachBus) {
  ScenarioRun run(two_busy_buses());
  run.advance_to(300ms);
  const Verdict verdict = run.verdict();
  EXPECT_EQ(verdict.outcome, Outcome::kPassed);
  EXPECT_EQ(verdict.expectations.at(0).expected.substr(0, 4), "test");
  EXPECT_EQ(verdict.expectations.at(1).expected.substr(0, 5), "other");
}

TEST(HostScript, SendsFramesInOrderOfTime) {
  const auto a = test::frame("141#01");
  const auto b = test::frame("141#02");
  // Frames of another bus, and frames with zero times, are not sent.
  HostScript script({{0, 5ms, a, 10ms, 3}, {1, 0ns, a}, {0, 7ms, b, 1ms, 0}, {0, 15ms, b}}, 0, 1s);
  std::vector<std::pair<SimTime, int>> sent;
  while (script.next_due() != SimTime::max()) {
    const TimedFrame frame = script.take();
    sent.emplace_back(frame.at, frame.frame.data[0]);
  }
  EXPECT_EQ(sent, (std::vector<std::pair<SimTime, int>>{
                      {1005ms, 1}, {1015ms, 1}, {1015ms, 2}, {1025ms, 1}}));
}

TEST(ScenarioText, WritesShortNumbersAndTimes) {
  EXPECT_EQ(number_text(101.3), "101.3");
  EXPECT_EQ(number_text(-0.123456789), "-0.123457");
  EXPECT_EQ(seconds_text(0ns), "0");
  EXPECT_EQ(seconds_text(1500ms), "1.5");
  EXPECT_EQ(seconds_text(1s + 1ns), "1.000000001");
  EXPECT_EQ(seconds_text(-1500ms), "-1.5");
}

TEST(Signals, AreFoundByTheirFullName) {
  ASSERT_NE(find_signal("speed_dps"), nullptr);
  EXPECT_EQ(find_signal("speed_dps")->name, "speed_dps");
  for (const char* name : {"", "speed", "speed_dps ", "Speed_dps"}) {
    EXPECT_EQ(find_signal(name), nullptr) << name;
  }
}

/// Frames of a host compiled into the test count like those of the scenario's own host.
TEST(ScenarioRun, AcceptsFramesOfAnotherHost) {
  Scenario scenario;
  scenario.robot = {test::bus_config({1}), test::bus_config({2}, 1'000'000)};
  scenario.robot[1].interface = "other";
  scenario.duration = 1s;
  // Age in ms since the query.
  const Replies expected{.command = 0x9C, .age = Range{0, 1}, .min_count = 2, .max_count = 2};
  scenario.expectations = {{1, 2, expected, throughout(0ns, 1s), ""}};
  scenario.sends = {{1, 500ms, test::frame("142#9C00000000000000")}};
  ScenarioRun run(scenario);
  run.advance_to(100ms);
  run.receive(1, {250ms, test::frame("142#9C00000000000000")});
  EXPECT_EQ(run.time(), 250ms);
  run.receive(1, {0ns, test::frame("142#9200000000000000")});  // a past time: counts as now
  EXPECT_EQ(run.time(), 250ms);
  run.advance_to(1s);
  std::vector<Traffic> traffic;
  run.take_traffic(traffic);
  ASSERT_EQ(traffic.size(), 6U);
  EXPECT_TRUE(traffic[0].from_host && traffic[1].from_host);
  EXPECT_EQ(traffic[1].frame.at, 250ms);
  EXPECT_EQ(traffic[3].frame.frame.data[0], 0x92);
  EXPECT_EQ(run.verdict().outcome, Outcome::kPassed);
}

}  // namespace scenario_run_test
}  // namespace lk::emulator
