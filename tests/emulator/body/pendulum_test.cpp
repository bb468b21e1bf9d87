// Tests the shipped pendulum, from its files.
#include <gtest/gtest.h>

#include "emulator/body/mujoco_body.hpp"
#include "emulator/config/scenario/config_scenario.hpp"
#include "emulator/core/scenario/scenario_run.hpp"
#include "tests/emulator/body/body_support.hpp"
#include "tests/support/profile.hpp"

namespace lk::emulator {
namespace pendulum_test {

using test::text_of;

const std::string kBodies = std::string(LKEMU_SOURCE_DIR) + "/configs/bodies/";

Scenario swing() {
  const LoadBody load = [](const std::string& /*file*/, const std::string& model, SimTime step) {
    return std::make_shared<MujocoBody>(kBodies + model + ".xml", step);
  };
  const ScenarioFiles files{.robot =
                                [&](const std::string& name, const Overrides& overrides) {
                                  return parse_config(text_of(kBodies + name), kBodies + name,
                                                      overrides, test::profile, load);
                                },
                            .text = {}};
  const std::string file = kBodies + "pendulum_swing.toml";
  return parse_scenario(text_of(file), file, std::nullopt, files);
}

TEST(Pendulum, FallsInItsScenario) {
  const Scenario scenario = swing();
  ScenarioRun run(scenario);
  run.advance_to(scenario.duration);
  const Verdict verdict = run.verdict();
  EXPECT_EQ(verdict.outcome, Outcome::kPassed);
  for (const std::string& reason : verdict.invalid) ADD_FAILURE() << reason;
  for (const ExpectationResult& result : verdict.expectations) {
    EXPECT_EQ(result.status, ExpectationResult::Status::kPassed)
        << result.expected << ": " << result.measured;
  }
}

/// The drive is idle, and its gear is back-drivable.
TEST(Pendulum, IsPushedByADirective) {
  Scenario scenario = swing();
  scenario.expectations.clear();
  scenario.sends.clear();
  scenario.robot[0].events = {
      {std::chrono::milliseconds(10),
       {kWholeBus,
        BodyAct{
            Push{.part = 1, .force_N = {5, 0, 0}, .duration = std::chrono::milliseconds(100)}}}}};
  ScenarioRun pushed(scenario);
  scenario.robot[0].events.clear();
  ScenarioRun left(scenario);
  pushed.advance_to(std::chrono::milliseconds(111));
  left.advance_to(std::chrono::milliseconds(111));
  const double J = pushed.body()->joint(0).inertia_kg_m2;
  EXPECT_EQ(left.body()->joint(0).angle_rad, 0);
  // 5 N at the centre of mass, 0.275 m, minus the gear's friction: upwards, and below the bound.
  EXPECT_GT(pushed.body()->joint(0).speed_rad_s, 0.1);
  EXPECT_LT(pushed.body()->joint(0).speed_rad_s, 5 * 0.275 * 0.1 / J);
}

}  // namespace pendulum_test
}  // namespace lk::emulator
