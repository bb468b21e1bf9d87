// The delivered scenarios, in addition to scenarios.pass_in_the_program: each passes with another
// seed too, and fails without its events, without effective faults, or with inverted expectations.

#include <gtest/gtest.h>

#include <filesystem>
#include <limits>
#include <sstream>

#include "emulator/config/scenario/config_scenario.hpp"
#include "emulator/core/scenario/scenario_run.hpp"
#include "emulator/core/scenario/scenario_text.hpp"
#include "emulator/files/output_file.hpp"
#include "emulator/monitor/scenario/scenario_report.hpp"
#include "tests/support/frames.hpp"
#include "tests/support/profile.hpp"

namespace lk::emulator {
namespace scenarios_test {

namespace fs = std::filesystem;

constexpr double kInf = std::numeric_limits<double>::infinity();

const fs::path kConfigs = fs::path(LKEMU_SOURCE_DIR) / "configs";

std::string text_of(const fs::path& file) { return read_regular_file(file, kLongestLog); }

const ScenarioFiles kFiles{
    .robot =
        [](const std::string& name, const Overrides& overrides) {
          const fs::path file = name.ends_with(".toml") ? kConfigs / "scenarios" / name
                                                        : kConfigs / "buses" / (name + ".toml");
          return parse_config(text_of(file), file.string(), overrides, test::profile);
        },
    .text = [](const std::string& name) { return text_of(kConfigs / "scenarios" / name); },
};

Scenario load(const std::string& name) {
  const fs::path file = kConfigs / "scenarios" / (name + ".toml");
  return parse_scenario(text_of(file), file.string(), std::nullopt, kFiles);
}

Verdict run(const Scenario& scenario) {
  ScenarioRun run(scenario);
  run.advance_to(scenario.duration);
  return run.verdict();
}

std::string told(const Verdict& verdict) {
  std::string text;
  for (const auto& result : verdict.expectations) {
    if (result.status == ExpectationResult::Status::kPassed) continue;
    text += result.expected + ": " + result.measured + '\n';
  }
  for (const std::string& reason : verdict.invalid) text += reason + '\n';
  return text;
}

/// tests/bodies covers robots with a body.
bool has_body(const std::string& name) {
  try {
    load(name);
  } catch (const ConfigError& problem) {
    return problem.key == "body";
  }
  return false;
}

std::vector<std::string> names() {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(kConfigs / "scenarios")) {
    const std::string name = entry.path().stem().string();
    if (entry.path().extension() == ".toml" && !has_body(name)) names.push_back(name);
  }
  std::ranges::sort(names);
  return names;
}

class ShippedScenario : public testing::TestWithParam<std::string> {};

/// Another seed means another specimen of the drive. The program runs them with their own seeds:
/// scenarios.NAME of tests/host.
TEST_P(ShippedScenario, PassesWithAnotherSeed) {
  const fs::path file = kConfigs / "scenarios" / (GetParam() + ".toml");
  const Verdict verdict = run(parse_scenario(text_of(file), file.string(), 4711, kFiles));
  EXPECT_EQ(verdict.outcome, Outcome::kPassed) << told(verdict);
}

TEST_P(ShippedScenario, DoesNotPassWithoutItsEvents) {
  Scenario scenario = load(GetParam());
  bool had_any = false;
  for (BusConfig& bus : scenario.robot) {
    had_any = had_any || !bus.events.empty();
    bus.events.clear();
  }
  if (!had_any) scenario.sends.clear();  // a scenario about an error of the host
  EXPECT_NE(run(scenario).outcome, Outcome::kPassed);
}

TEST_P(ShippedScenario, IsInvalidWhenItsFaultsHaveNoEffect) {
  Scenario scenario = load(GetParam());
  std::size_t faults = 0;
  for (BusConfig& bus : scenario.robot) {
    for (TimedDirective& event : bus.events) {
      if (!std::holds_alternative<SetFault>(event.directive.what)) continue;
      event.at = scenario.duration;  // too late to have an effect
      ++faults;
    }
    std::ranges::stable_sort(bus.events, {}, &TimedDirective::at);
  }
  if (faults == 0) GTEST_SKIP() << "no faults in it";
  EXPECT_NE(run(scenario).outcome, Outcome::kPassed);
}

/// An estimator with its pole at −1.5 (1/(1 + x) at x = −5/3), which no file can configure: the
/// loops' speed oscillates without bounds.
TEST(Verdict, IsInvalidWhenTheLoopsDiverge) {
  Scenario scenario;
  scenario.robot = parse_config("[[bus]]\ninterface = \"a\"\n[[bus.drive]]\nid = 1\n", "a.toml", {},
                                test::profile);
  scenario.duration = std::chrono::seconds(1);
  scenario.sends = {
      {.at = std::chrono::milliseconds(60), .frame = test::frame("141#A200000010270000")}};
  EXPECT_EQ(run(scenario).outcome, Outcome::kPassed);
  model::DriveParams& drive = scenario.robot[0].servos[0].profile.drive;
  const double T_m = drive.control.motion_divider / drive.inverter.f_pwm;
  drive.control.estimator_bandwidth = -5.0 / 3.0 / T_m;
  const Verdict verdict = run(scenario);
  EXPECT_EQ(verdict.outcome, Outcome::kInvalid);
  ASSERT_EQ(verdict.invalid.size(), 1U);
  EXPECT_EQ(verdict.invalid[0],
            "a drive 1: the simulation diverged; check the parameters of its motor");
}

/// Inverts each expectation so that no value can meet it.
TEST_P(ShippedScenario, FailsWithInvertedExpectations) {
  const Scenario scenario = load(GetParam());
  Scenario turned = scenario;
  for (Expectation& expectation : turned.expectations) {
    if (auto* within = std::get_if<SignalWithin>(&expectation.what)) {
      // Beyond one of the two ends: no value of the expected range remains.
      const bool has_max = !std::isinf(within->range.max);
      within->range =
          has_max ? Range{within->range.max + 1e-9, kInf} : Range{-kInf, within->range.min - 1e-9};
      // An expectation for some time becomes a condition for all times.
      if (expectation.when.kind == Period::Kind::kBy) {
        expectation.when.kind = Period::Kind::kThroughout;
      }
    } else if (auto* error = std::get_if<ErrorIs>(&expectation.what)) {
      error->set = !error->set;
      if (expectation.when.kind == Period::Kind::kBy) {
        expectation.when.kind = Period::Kind::kThroughout;
      }
    } else if (auto* replies = std::get_if<Replies>(&expectation.what)) {
      if (replies->min_count > 0) {
        replies->max_count = replies->min_count - 1;
        replies->min_count = 0;
      } else {
        replies->min_count = replies->max_count + 1;
        replies->max_count = std::numeric_limits<std::uint64_t>::max();
      }
    }
  }
  const Verdict verdict = run(turned);
  EXPECT_FALSE(verdict.expectations.empty());
  for (const ExpectationResult& result : verdict.expectations) {
    EXPECT_EQ(result.status, ExpectationResult::Status::kFailed) << result.expected;
  }
}

INSTANTIATE_TEST_SUITE_P(Scenarios, ShippedScenario, testing::ValuesIn(names()),
                         [](const auto& name) { return name.param; });

TEST(Scenarios, AreAtLeastTwelve) { EXPECT_GE(names().size(), 12U); }

/// The example of docs/guides/scenarios.md, except for its first line, which contains the
/// wall-clock time.
TEST(Scenarios, OutputMatchesTheDocument) {
  const Scenario scenario = load("jammed_joint");
  RunReport report;
  report.verdict = run(scenario);
  const std::string printed = report_text(report, false);
  std::istringstream lines(text_of(fs::path(LKEMU_SOURCE_DIR) / "docs/guides/scenarios.md"));
  int shown = 0;
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("      pass  ") && !line.starts_with("      fault ")) continue;
    ++shown;
    EXPECT_NE(printed.find(line.substr(4) + '\n'), std::string::npos) << line << "\nprinted:\n"
                                                                      << printed;
  }
  EXPECT_EQ(shown, 2);
}

}  // namespace scenarios_test
}  // namespace lk::emulator
