#include "tools/campaign/plan/case_scenario.hpp"

#include <gtest/gtest.h>

#include "emulator/core/scenario/scenario_run.hpp"
#include "tests/tools/campaign/plan/plan_support.hpp"
#include "tools/campaign/plan/sampling.hpp"
#include "tools/cases/toml_text.hpp"

namespace lk::emulator {
namespace {

constexpr const char* kRest = R"(
[detect]
drive = "stall"
[[detect.host]]
id = 1
answered = { within_s = 0.02 }
)";
constexpr const char* kDimensions = R"(
fault.kind = ["silent", "jam"]
fault.id = 1
fault.at_s = [0.5, 0.75]
fault.for_s = 0.2
supply_V = [22, 26]
ambient_C = 35
load.J_g_cm2 = 400000
seed = 7
generation = "v236"
bus_load = 0.5
)";

class CaseOfPlan : public testing::Test {
 protected:
  Plan plan_ = plan_of("full", kDimensions, kRest);
  CaseScenarios scenarios_{plan_};
  CaseValues values_ = *CaseNumbers(plan_).values(3);  // silent, 0.75 s, 26 V
};

TEST_F(CaseOfPlan, HasItsValuesInTheScenario) {
  const CaseGroup group = scenarios_.group(values_);
  const BusConfig& bus = group.scenario.robot.front();
  EXPECT_EQ(bus.seed, 7U);
  EXPECT_EQ(bus.servos.front().generation, Generation::kV236);
  Bus running(bus);
  running.advance_to(SimTime{0});  // what happens at 0
  const Surroundings around = running.surroundings(1);
  EXPECT_EQ(around.supply_V, 26);
  EXPECT_EQ(around.ambient_C, 35);
  EXPECT_DOUBLE_EQ(around.load.J, 400000 * 1e-7);
  EXPECT_DOUBLE_EQ(around.load.tau_gravity, 1.5);  // of the robot's file: it stays
  const std::vector<PlannedDirective> fault = scenarios_.fault(values_, group.scenario);
  ASSERT_EQ(fault.size(), 1U);
  EXPECT_EQ(fault[0].directive.at, std::chrono::milliseconds(750));
}

// With 17 digits they would be 0.10000000000000001, 3.2999999999999998, 9.9999999999999995e-07.
TEST(CaseText, HasTheShortestNumbersThatReadBackTheSame) {
  const std::string text = R"(about = "a \"b\""
at_s = 0.1
"two words" = 1e+22
within = [ -1.0, 3.3, 1e-06 ]

[[event]]
fault = { for_s = 0.30000000000000004, kind = "jam" }
id = 1

[[event]]
at_s = 2.5
)";
  const toml::table document = parse_toml(text, "case.toml");
  EXPECT_EQ(toml_text(document), text);
  EXPECT_EQ(parse_toml(toml_text(document), "again.toml"), document);
}

// 0.5 of 1 Mbit/s by frames of 111 bits and about 9.5 stuff bits: one in 241 us.
TEST_F(CaseOfPlan, TakesItsShareOfTheWire) {
  const CaseGroup group = scenarios_.group(values_);
  ScenarioRun run(group.scenario);
  run.advance_to(std::chrono::seconds(1));
  const double busy = std::chrono::duration<double>(run.bus(0).stats().wire_busy).count();
  EXPECT_NEAR(busy, 0.5, 0.05);  // the stuff bits of these frames are not counted one by one
}

TEST_F(CaseOfPlan, GroupsWhatDiffersInTheFaultAlone) {
  const CaseNumbers numbers(plan_);
  EXPECT_EQ(scenarios_.group_key(*numbers.values(1)), scenarios_.group_key(*numbers.values(3)));
  EXPECT_NE(scenarios_.group_key(*numbers.values(2)), scenarios_.group_key(*numbers.values(3)));
}

TEST_F(CaseOfPlan, WatchesDriveAndHostBehindItsOwnExpectations) {
  const CaseGroup group = scenarios_.group(values_);
  EXPECT_EQ(group.watched.own, 6U);
  EXPECT_EQ(group.watched.drive, 1U);
  EXPECT_EQ(group.watched.host, 1U);
  EXPECT_EQ(group.scenario.expectations.size(), 8U);
  EXPECT_EQ(group.fires_by_failing, std::vector<bool>{true});
}

TEST_F(CaseOfPlan, IsAScenarioFileOfTheSameContent) {
  const std::string text = scenarios_.file_text(values_, false);
  CaseFiles files("/");
  const Scenario read = parse_scenario(text, "case.toml", std::nullopt, files.files());
  const CaseGroup group = scenarios_.group(values_);
  EXPECT_EQ(read.expectations.size(), group.watched.own);
  ScenarioRun from_file(read);
  ScenarioRun from_plan(group.scenario);
  for (const PlannedDirective& one : scenarios_.fault(values_, group.scenario)) {
    from_plan.plan(one.bus, one.directive);
  }
  std::vector<Traffic> of_file;
  std::vector<Traffic> of_plan;
  for (ScenarioRun* run : {&from_file, &from_plan}) run->advance_to(std::chrono::seconds(1));
  from_file.take_traffic(of_file);
  from_plan.take_traffic(of_plan);
  ASSERT_EQ(of_file.size(), of_plan.size());
  for (std::size_t n = 0; n < of_file.size(); ++n) {
    EXPECT_EQ(of_file[n].frame.at, of_plan[n].frame.at);
    EXPECT_EQ(of_file[n].frame.frame, of_plan[n].frame.frame);
  }
}

}  // namespace
}  // namespace lk::emulator
