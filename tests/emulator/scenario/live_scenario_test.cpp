// A scenario on a line without an interface, together with a host.

#include "emulator/io/program/live_scenario.hpp"

#include <gtest/gtest.h>

#include "emulator/core/faults/fault_table.hpp"
#include "emulator/core/faults/make_fault.hpp"
#include "tests/support/test_bus.hpp"

namespace lk::emulator {
namespace live_scenario_test {

using namespace std::chrono_literals;

/// A line that has run for a while before the scenario begins.
class Live : public testing::Test {
 protected:
  Live() { go_to(10s); }

  void go_to(SimTime until) { line_.advance_to(until, MonoTime::max(), Line::WaitPolicy::kNone); }
  Scenario scenario() const {
    Scenario scenario;
    scenario.name = "live";
    scenario.robot = {line_.config()};
    scenario.duration = 1s;
    return scenario;
  }
  static Expectation answered(std::uint64_t count) {
    Replies replies;
    replies.command = 0x9C;
    replies.min_count = replies.max_count = count;
    return {0, 1, replies, {Period::Kind::kThroughout, 0ns, 1s}, ""};
  }

  static std::optional<std::string> well() { return std::nullopt; }

  Line line_{test::bus_config({1, 2})};
  int overs_ = 0;
};

TEST_F(Live, ReceivesFramesOfTheHostAndItsOwn) {
  Scenario plan = scenario();
  plan.sends = {{0, 200ms, test::frame("141#9C00000000000000"), 100ms, 2}};
  plan.expectations = {answered(3)};
  LiveScenario live(
      plan, {&line_}, [this] { ++overs_; }, well);
  line_.accept({10s + 500ms, test::frame("141#9C00000000000000")});
  go_to(11s - 1ms);
  EXPECT_EQ(overs_, 0);
  EXPECT_EQ(live.report().verdict.expectations.at(0).status, ExpectationResult::Status::kOpen);
  go_to(12s);
  EXPECT_EQ(overs_, 1);
  // Later frames do not belong to the scenario.
  line_.accept({12s, test::frame("141#9C00000000000000")});
  go_to(13s);
  live.finish();
  EXPECT_EQ(overs_, 1);
  EXPECT_EQ(live.report().verdict.outcome, Outcome::kPassed);
  EXPECT_EQ(live.report().simulated, 1s);
}

/// The account tells whether two runs received equal frames at equal times.
TEST_F(Live, ReportsAHashOfTheReplies) {
  Scenario plan = scenario();
  plan.expectations = {answered(0)};
  const auto account_of = [&](const char* query, SimTime delay) {
    const SimTime start = line_.bus().time();
    LiveScenario live(
        plan, {&line_}, [] {}, well);
    line_.accept({start + delay, test::frame(query)});
    go_to(start + 1s);
    live.finish();
    // Later frames do not belong to the scenario.
    line_.accept({start + 1s, test::frame(query)});
    go_to(start + 2s);
    return live.report().accounts.at(0);
  };
  const BusAccount account = account_of("141#9A00000000000000", 100ms);
  EXPECT_EQ(account.bus, line_.name());
  EXPECT_EQ(account.start, 10s);
  EXPECT_EQ(account.replies, 1U);
  EXPECT_TRUE(account.errors.empty());
  EXPECT_EQ(account_of("141#9A00000000000000", 100ms).replies_hash, account.replies_hash);
  EXPECT_NE(account_of("142#9A00000000000000", 100ms).replies_hash, account.replies_hash);
  EXPECT_NE(account_of("141#9A00000000000000", 200ms).replies_hash, account.replies_hash);
  EXPECT_EQ(account_of("145#9A00000000000000", 100ms).replies, 0U);
}

TEST_F(Live, UsesRelativeTimesAndClearsItsFaults) {
  Fault hang;
  hang.row = find_fault("hang");
  hang.ids = {1};
  Scenario plan = scenario();
  plan.robot[0].events = {{500ms, {kWholeBus, SetFault{hang}}, std::nullopt}};
  plan.sends = {{0, 400ms, test::frame("141#9C00000000000000"), 200ms, 2}};
  plan.expectations = {answered(1)};
  LiveScenario live(
      plan, {&line_}, [this] { ++overs_; }, well);
  go_to(11s);
  live.finish();
  const Verdict verdict = live.report().verdict;
  EXPECT_EQ(verdict.outcome, Outcome::kPassed);
  ASSERT_EQ(verdict.faults.size(), 1U);
  EXPECT_EQ(verdict.faults[0].report.evidence.began_at, 500ms);
  EXPECT_EQ(verdict.faults[0].report.evidence.first_effect_at, 600ms);
  EXPECT_EQ(line_.bus().faults().at(0).evidence.state, FaultEvidence::State::kCleared);
}

/// The verdict is invalid if data for it is missing.
TEST_F(Live, IsInvalidIfFaultsWereEvicted) {
  LiveScenario live(
      scenario(), {&line_}, [] {}, well);
  for (std::size_t n = 0; n < Bus::kMaxFaults + 2; ++n) {
    const Fault reset = make_fault("reset", {}, {1});
    ASSERT_TRUE(line_.perform({line_.bus().time(), {kWholeBus, SetFault{reset}}, std::nullopt}));
  }
  go_to(11s);
  live.finish();
  const Verdict verdict = live.report().verdict;
  EXPECT_EQ(verdict.outcome, Outcome::kInvalid);
  ASSERT_EQ(verdict.invalid.size(), 1U);
  EXPECT_EQ(verdict.invalid[0], line_.name() +
                                    ": 2 faults ended and were removed before the verdict to make "
                                    "room; their effect is unknown");
}

TEST_F(Live, IsInvalidIfAFaultWasRejected) {
  Scenario plan = scenario();
  plan.robot[0].events = {
      {500ms, {kWholeBus, SetFault{make_fault("hang", {}, {1})}}, std::nullopt}};
  LiveScenario live(
      plan, {&line_}, [] {}, well);
  for (std::size_t n = 0; n < Bus::kMaxFaults; ++n) {
    const Fault later = make_fault("reset", {}, {2});
    ASSERT_TRUE(line_.perform({10s + 900ms, {kWholeBus, SetFault{later}}, std::nullopt}));
  }
  go_to(11s);
  live.finish();
  const Verdict verdict = live.report().verdict;
  EXPECT_EQ(verdict.outcome, Outcome::kInvalid);
  ASSERT_FALSE(verdict.invalid.empty());
  EXPECT_EQ(verdict.invalid.back(), line_.name() +
                                        ": the event planned for 0.5 s found no room on the bus; "
                                        "clear faults or conditions before it");
}

TEST_F(Live, IgnoresEarlierFaults) {
  Fault hang;
  hang.row = find_fault("hang");
  hang.ids = {2};
  line_.perform({10s, {kWholeBus, SetFault{hang}}, std::nullopt});
  Scenario plan = scenario();
  plan.expectations = {answered(0)};
  LiveScenario live(
      plan, {&line_}, [this] { ++overs_; }, well);
  go_to(11s);
  live.finish();
  EXPECT_EQ(live.report().verdict.outcome, Outcome::kPassed);
  EXPECT_TRUE(live.report().verdict.faults.empty());
  EXPECT_EQ(line_.bus().faults().at(0).evidence.state, FaultEvidence::State::kActive);
}

TEST_F(Live, IsInvalidIfItEndsEarly) {
  Fault hang;
  hang.row = find_fault("hang");
  hang.ids = {1};
  Scenario plan = scenario();
  plan.robot[0].events = {{500ms, {kWholeBus, SetFault{hang}}, std::nullopt}};
  plan.expectations = {
      {0, 1, SignalWithin{find_signal("alive"), {1, 1}}, {Period::Kind::kAt, 0ns, 100ms}, ""}};
  LiveScenario live(
      plan, {&line_}, [this] { ++overs_; }, well);
  go_to(10s + 300ms);
  live.finish();
  const Verdict verdict = live.report().verdict;
  EXPECT_EQ(verdict.expectations.at(0).status, ExpectationResult::Status::kPassed);
  EXPECT_EQ(verdict.outcome, Outcome::kInvalid);
  EXPECT_EQ(verdict.invalid.size(), 2U);  // the time, and the fault that never began
}

TEST_F(Live, IgnoresEventsAfterItsEnd) {
  Fault hang;
  hang.row = find_fault("hang");
  hang.ids = {1};
  Scenario plan = scenario();
  plan.robot[0].events = {{500ms, {kWholeBus, SetFault{hang}}, std::nullopt}};
  LiveScenario live(
      plan, {&line_}, [this] { ++overs_; }, well);
  go_to(11s + 200ms);  // the listener runs late
  line_.accept({11s + 200ms, test::frame("141#9C00000000000000")});
  go_to(11s + 300ms);
  live.finish();
  EXPECT_EQ(live.report().verdict.outcome, Outcome::kInvalid);  // the fault had no effect in time
  EXPECT_EQ(line_.bus().faults().at(0).evidence.effects, 0U);
}

TEST_F(Live, CancelsPlannedEventsWhenStopped) {
  Scenario plan = scenario();
  plan.robot[0].events = {{500ms, {1, TurnShaft{90}}, std::nullopt}};
  plan.expectations = {answered(0)};
  {
    LiveScenario live(
        plan, {&line_}, [this] { ++overs_; }, well);
    go_to(10s + 100ms);
    live.finish();
    EXPECT_EQ(live.report().verdict.outcome, Outcome::kInvalid);
  }
  const double before = line_.bus().truth(1).theta_out;
  go_to(12s);
  EXPECT_NEAR(line_.bus().truth(1).theta_out, before, 0.01);
  EXPECT_EQ(overs_, 0);
}

}  // namespace live_scenario_test
}  // namespace lk::emulator
