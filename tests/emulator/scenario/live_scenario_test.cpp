// A scenario on a line without an interface, together with a host.

#include "emulator/io/program/live_scenario.hpp"

#include <gtest/gtest.h>

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

  LiveScenario begin(const Scenario& plan) {
    return {plan, {&line_}, [this] { ++overs_; }, [] { return std::nullopt; }};
  }
  /// Runs the scenario until its end.
  Verdict run(const Scenario& plan) {
    LiveScenario live = begin(plan);
    return finish(live, 11s);
  }
  Verdict finish(LiveScenario& live, SimTime until) {
    go_to(until);
    live.finish();
    return live.report().verdict;
  }
  static Directive set_fault(const char* kind, int id) {
    return {kWholeBus, SetFault{make_fault(kind, {}, {id})}};
  }

  Line line_{test::bus_config({1, 2})};
  int overs_ = 0;
};

TEST_F(Live, ReceivesFramesOfTheHostAndItsOwn) {
  Scenario plan = scenario();
  plan.sends = {{0, 200ms, test::frame("141#9C00000000000000"), 100ms, 2}};
  plan.expectations = {answered(3)};
  LiveScenario live = begin(plan);
  line_.accept({10s + 500ms, test::frame("141#9C00000000000000")});
  go_to(11s - 1ms);
  EXPECT_EQ(overs_, 0);
  EXPECT_EQ(live.report().verdict.expectations.at(0).status, ExpectationResult::Status::kOpen);
  go_to(12s);
  EXPECT_EQ(overs_, 1);
  // Later frames do not belong to the scenario.
  line_.accept({12s, test::frame("141#9C00000000000000")});
  EXPECT_EQ(finish(live, 13s).outcome, Outcome::kPassed);
  EXPECT_EQ(overs_, 1);
  EXPECT_EQ(live.report().simulated, 1s);
}

/// The account tells whether two runs received equal frames at equal times.
TEST_F(Live, ReportsAHashOfTheReplies) {
  Scenario plan = scenario();
  plan.expectations = {answered(0)};
  const auto account_of = [&](const char* query, SimTime delay) {
    const SimTime start = line_.bus().time();
    LiveScenario live = begin(plan);
    line_.accept({start + delay, test::frame(query)});
    finish(live, start + 1s);
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
  Scenario plan = scenario();
  plan.robot[0].events = {{500ms, set_fault("hang", 1), std::nullopt}};
  plan.sends = {{0, 400ms, test::frame("141#9C00000000000000"), 200ms, 2}};
  plan.expectations = {answered(1)};
  const Verdict verdict = run(plan);
  EXPECT_EQ(verdict.outcome, Outcome::kPassed);
  ASSERT_EQ(verdict.faults.size(), 1U);
  EXPECT_EQ(verdict.faults[0].report.evidence.began_at, 500ms);
  EXPECT_EQ(verdict.faults[0].report.evidence.first_effect_at, 600ms);
  EXPECT_EQ(line_.bus().faults().at(0).evidence.state, FaultEvidence::State::kCleared);
}

/// The verdict is invalid if data for it is missing.
TEST_F(Live, IsInvalidIfFaultsWereEvicted) {
  LiveScenario live = begin(scenario());
  for (std::size_t n = 0; n < Bus::kMaxFaults + 2; ++n) {
    ASSERT_TRUE(line_.perform({line_.bus().time(), set_fault("reset", 1), std::nullopt}));
  }
  const Verdict verdict = finish(live, 11s);
  EXPECT_EQ(verdict.outcome, Outcome::kInvalid);
  ASSERT_EQ(verdict.invalid.size(), 1U);
  EXPECT_EQ(verdict.invalid[0], line_.name() +
                                    ": 2 faults ended and were removed before the verdict to make "
                                    "room; their effect is unknown");
}

TEST_F(Live, IsInvalidIfAFaultWasRejected) {
  Scenario plan = scenario();
  plan.robot[0].events = {{500ms, set_fault("hang", 1), std::nullopt}};
  LiveScenario live = begin(plan);
  for (std::size_t n = 0; n < Bus::kMaxFaults; ++n) {
    ASSERT_TRUE(line_.perform({10s + 900ms, set_fault("reset", 2), std::nullopt}));
  }
  const Verdict verdict = finish(live, 11s);
  EXPECT_EQ(verdict.outcome, Outcome::kInvalid);
  ASSERT_FALSE(verdict.invalid.empty());
  EXPECT_EQ(verdict.invalid.back(), line_.name() +
                                        ": the event planned for 0.5 s found no room on the bus; "
                                        "clear faults or conditions before it");
}

TEST_F(Live, IgnoresEarlierFaults) {
  line_.perform({10s, set_fault("hang", 2), std::nullopt});
  Scenario plan = scenario();
  plan.expectations = {answered(0)};
  const Verdict verdict = run(plan);
  EXPECT_EQ(verdict.outcome, Outcome::kPassed);
  EXPECT_TRUE(verdict.faults.empty());
  EXPECT_EQ(line_.bus().faults().at(0).evidence.state, FaultEvidence::State::kActive);
}

TEST_F(Live, IsInvalidIfItEndsEarly) {
  Scenario plan = scenario();
  plan.robot[0].events = {{500ms, set_fault("hang", 1), std::nullopt}};
  plan.expectations = {
      {0, 1, SignalWithin{find_signal("alive"), {1, 1}}, {Period::Kind::kAt, 0ns, 100ms}, ""}};
  LiveScenario live = begin(plan);
  const Verdict verdict = finish(live, 10s + 300ms);
  EXPECT_EQ(verdict.expectations.at(0).status, ExpectationResult::Status::kPassed);
  EXPECT_EQ(verdict.outcome, Outcome::kInvalid);
  EXPECT_EQ(verdict.invalid.size(), 2U);  // the time, and the fault that never began
}

TEST_F(Live, IgnoresEventsAfterItsEnd) {
  Scenario plan = scenario();
  plan.robot[0].events = {{500ms, set_fault("hang", 1), std::nullopt}};
  LiveScenario live = begin(plan);
  go_to(11s + 200ms);  // the listener runs late
  line_.accept({11s + 200ms, test::frame("141#9C00000000000000")});
  EXPECT_EQ(finish(live, 11s + 300ms).outcome,
            Outcome::kInvalid);  // the fault had no effect in time
  EXPECT_EQ(line_.bus().faults().at(0).evidence.effects, 0U);
}

TEST_F(Live, CancelsPlannedEventsWhenStopped) {
  Scenario plan = scenario();
  plan.robot[0].events = {{500ms, {1, TurnShaft{90}}, std::nullopt}};
  plan.expectations = {answered(0)};
  {
    LiveScenario live = begin(plan);
    EXPECT_EQ(finish(live, 10s + 100ms).outcome, Outcome::kInvalid);
  }
  const double before = line_.bus().truth(1).theta_out;
  go_to(12s);
  EXPECT_NEAR(line_.bus().truth(1).theta_out, before, 0.01);
  EXPECT_EQ(overs_, 0);
}

}  // namespace live_scenario_test
}  // namespace lk::emulator
