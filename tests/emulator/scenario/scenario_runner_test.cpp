// Runs a scenario with its outputs and checks its report.

#include "emulator/monitor/scenario/scenario_runner.hpp"

#include <gtest/gtest.h>

#include "emulator/config/scenario/config_scenario.hpp"
#include "emulator/monitor/scenario/scenario_report.hpp"
#include "tests/support/profile.hpp"

namespace lk::emulator {
namespace scenario_runner_test {

/// One drive with a lost-input error after `timeout_s`, and a frame at 0.3 s.
RunReport run(const std::string& timeout_s, const std::string& more = "") {
  const ScenarioFiles files{.robot =
                                [&](const std::string& /*name*/, const Overrides& overrides) {
                                  const std::string text =
                                      "[[bus]]\ninterface = \"vcan0\"\n[[bus.drive]]\nid = 1\n"
                                      "[bus.drive.settings.protection]\n"
                                      "lost_input = { enabled = true, threshold_s = " +
                                      timeout_s + " }\n";
                                  return parse_config(text, "robot.toml", overrides, test::profile);
                                },
                            .text = {}};
  const std::string scenario =
      "robot = \"robot\"\nduration_s = 0.5\n[[send]]\nat_s = 0.3\nid = 1\ncommand = \"state_2\"\n"
      "[[expect]]\nid = 1\nsignal = \"alive\"\nmin = 1\nfrom_s = 0.4\n" +
      more;
  return run_scenario(parse_scenario(scenario, "early.toml", std::nullopt, files), {});
}

TEST(ScenarioRunner, WarnsOfProtectionTrippedBeforeTheFirstFrame) {
  const RunReport report = run("0.1");
  ASSERT_EQ(report.warnings.size(), 1U);
  EXPECT_TRUE(report.warnings[0].starts_with("vcan0 drive 1: lost_input trips at 0.1"))
      << report.warnings[0];
  EXPECT_TRUE(report.warnings[0].ends_with(
      ", before the first frame; check settings.protection.lost_input"))
      << report.warnings[0];
  EXPECT_NE(report_text(report, false).find("  warning: vcan0 drive 1: lost_input"),
            std::string::npos);
  EXPECT_NE(report_text(report, false).find(", 1 drive, "), std::string::npos);
}

TEST(ScenarioRunner, IgnoresLateAndIntendedProtectionTrips) {
  EXPECT_TRUE(run("1").warnings.empty());
  EXPECT_TRUE(run("0.1", "[[event]]\nat_s = 0.01\nid = 1\nsupply_V = 20\n").warnings.empty());
}

}  // namespace scenario_runner_test
}  // namespace lk::emulator
