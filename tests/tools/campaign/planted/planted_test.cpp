// The planted hosts are as they should be: well without a fault, wherever in their space, and
// failing in the cases that are known.

#include <gtest/gtest.h>

#include "tests/tools/campaign/planted/planted_case.hpp"
#include "tests/tools/campaign/planted/planted_random.hpp"

namespace lk::emulator::planted {

void PrintTo(const Bug& bug, std::ostream* out) { *out << bug.name; }

namespace planted_test {

PlantedRun run_of(const Bug& bug, const Values& values) {
  const PlantedCase one = case_of(base_scenario(bug), values);
  return bug.run(one.scenario, one.host);
}

class Planted : public testing::TestWithParam<Bug> {};

TEST_P(Planted, DoesItsWorkWithoutFaults) {
  std::mt19937_64 random(1);
  for (int n = 0; n < 20; ++n) {
    Values values = draw_case(GetParam(), random);
    values.erase("fault.kind");
    const PlantedRun run = run_of(GetParam(), values);
    EXPECT_FALSE(run.failed) << n;
    EXPECT_FALSE(run.fired) << n;
    EXPECT_GT(run.margin, 0) << n;
    EXPECT_LE(run.margin, 1) << n;
  }
}

TEST_P(Planted, FailsInKnownCasesAndNotBesideThem) {
  int known = 0;
  for (const KnownCase& one : known_cases()) {
    if (one.bug != GetParam().name) continue;
    ++known;
    const PlantedRun failing = run_of(GetParam(), one.fails);
    EXPECT_TRUE(failing.failed);
    EXPECT_TRUE(failing.fired);
    EXPECT_LT(failing.margin, 0);
    Values beside = one.fails;
    beside[one.moved] = one.passes_at;
    const PlantedRun passing = run_of(GetParam(), beside);
    EXPECT_FALSE(passing.failed) << one.moved;
    EXPECT_TRUE(passing.fired) << one.moved;
    EXPECT_GT(passing.margin, 0) << one.moved;
  }
  EXPECT_GE(known, 1);
}

TEST_P(Planted, IsTheSameEveryTime) {
  std::mt19937_64 random(2);
  const Values values = draw_case(GetParam(), random);
  const PlantedRun first = run_of(GetParam(), values);
  const PlantedRun second = run_of(GetParam(), values);
  EXPECT_EQ(first.margin, second.margin);
  EXPECT_EQ(first.failed, second.failed);
}

TEST_P(Planted, VariesFourToSevenThings) {
  EXPECT_GE(GetParam().dimensions.size(), 4U);
  EXPECT_LE(GetParam().dimensions.size(), 7U);
}

INSTANTIATE_TEST_SUITE_P(Bugs, Planted, testing::ValuesIn(all_bugs()),
                         [](const auto& bug) { return bug.param.name; });

TEST(PlantedBugs, AreTenOfWhichFourHaveNoGradient) {
  EXPECT_EQ(bugs_with_gradient().size(), 6U);
  EXPECT_EQ(bugs_without_gradient().size(), 4U);
  for (const Bug& bug : bugs_with_gradient()) EXPECT_TRUE(bug.has_gradient) << bug.name;
  for (const Bug& bug : bugs_without_gradient()) EXPECT_FALSE(bug.has_gradient) << bug.name;
}

// The margin of a needle says the same of all cases that pass.
TEST(PlantedBugs, WithoutGradientAreAlikeUntilTheyFail) {
  for (const Bug& bug : bugs_without_gradient()) {
    std::mt19937_64 random(3);
    int compared = 0;
    for (int n = 0; n < 30; ++n) {
      const PlantedRun run = run_of(bug, draw_case(bug, random));
      if (run.failed) continue;
      ++compared;
      EXPECT_NEAR(run.margin, 0.49, 0.02) << bug.name;
    }
    EXPECT_GT(compared, 0) << bug.name;
  }
}

TEST(PlantedCase, HasItsValues) {
  const Bug bug = all_bugs().front();
  const PlantedCase one = case_of(base_scenario(bug), {{"fault.kind", "drop"},
                                                       {"fault.at_s", 0.25},
                                                       {"fault.for_s", 0.125},
                                                       {"fault.probability", 0.5},
                                                       {"fault.drop.frames", "both"},
                                                       {"fault.jam.percent", 10.0},
                                                       {"seed", 7.0},
                                                       {"supply_V", 20.0},
                                                       {"ambient_C", 30.0},
                                                       {"load.J_g_cm2", 500.0},
                                                       {"host.tick", 3.0}});
  const BusConfig& bus = one.scenario.robot.front();
  ASSERT_EQ(bus.events.size(), 1U);
  EXPECT_EQ(bus.events.front().at, std::chrono::milliseconds(250));
  const Fault& fault = std::get<SetFault>(bus.events.front().directive.what).fault;
  EXPECT_EQ(fault.name, "drop");
  EXPECT_EQ(fault.ids, std::vector<int>{1});
  EXPECT_EQ(fault.duration, std::chrono::milliseconds(125));
  EXPECT_EQ(fault.probability, 0.5);
  EXPECT_EQ(fault.values[0], FaultValue(static_cast<FaultChoice>(2)));  // replies, queries, both
  EXPECT_EQ(bus.seed, 7U);
  EXPECT_EQ(bus.servos.front().profile.drive.supply.v_source, 20);
  EXPECT_EQ(bus.servos.front().profile.drive.thermal.temp_ambient, 30);
  EXPECT_NEAR(bus.servos.front().profile.drive.load.J, 5e-5, 1e-12);
  EXPECT_EQ(one.host, (HostValues{{"tick", 3}}));
}

TEST(PlantedCase, RefusesWhatThereIsNot) {
  const Scenario base = base_scenario(all_bugs().front());
  EXPECT_THROW(case_of(base, {{"fault.kind", "gremlin"}}), std::invalid_argument);
  EXPECT_THROW(case_of(base, {{"fault.kind", "drop"}, {"fault.drop.frames", "some"}}),
               std::invalid_argument);
  EXPECT_THROW(case_of(base, {{"weather", 1.0}}), std::invalid_argument);
}

// Widths of the range, from the nearer bound, at the worst instant.
TEST(MarginWatch, MeasuresTheWorstFromTheNearerBound) {
  Scenario scenario = base_scenario(bugs_without_gradient().front());  // at rest at 0
  Expectation& expectation = scenario.expectations.front();
  expectation.when = {.kind = Period::Kind::kThroughout, .from = SimTime{0}, .to = SimTime{0}};
  const ScenarioRun run(scenario);
  constexpr double kTolerance = 0.01;  // it boots on a count of its encoder
  const auto margin = [&](double min, double max) {
    std::get<SignalWithin>(expectation.what).range = {.min = min, .max = max};
    MarginWatch watch(scenario);
    watch.look(run.bus(0));
    return watch.margin();
  };
  EXPECT_NEAR(margin(-10, 30), 0.25, kTolerance);
  EXPECT_NEAR(margin(-30, 10), 0.25, kTolerance);
  EXPECT_NEAR(margin(10, 30), -0.5, kTolerance);
  EXPECT_NEAR(margin(-1, 1), 0.5, kTolerance);
}

}  // namespace planted_test
}  // namespace lk::emulator::planted
