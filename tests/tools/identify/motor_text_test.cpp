#include "tools/identify/motor_text.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "emulator/config/config_error.hpp"
#include "tests/tools/identify/planted.hpp"
#include "tools/identify/report.hpp"

namespace lk::test {
namespace {

emulator::IdentifiedDrive identified(const Planted& made, unsigned seed) {
  const auto limits = emulator::plan_limits(made.base);
  const std::string log = plan_log(made, seed, emulator::plan_steps(limits), 2 * limits.speed_dps);
  auto tracks = emulator::read_tracks(log, {.base = made.base, .generation = {}, .id = {}});
  return emulator::identify(std::move(tracks.at(0)));
}

/// One motor for all of these: its log takes a while.
const emulator::IdentifiedDrive& march() {
  static const auto drive = identified(planted(3), 3);
  return drive;
}
const std::string& march_text() {
  static const std::string text =
      emulator::motor_text(march(), planted(3).base.name, {"march \"1\".log"});
  return text;
}

TEST(MotorText, IsAMotorFileWithTheNumbersThatWereFound) {
  const auto profile = emulator::parse_profile({"my.toml", "my.toml", march_text()}, motor_file);
  const auto& planted_m = planted(3).servo.profile.drive.mechanics;
  const auto& m = profile.drive.mechanics;
  EXPECT_NEAR(m.J, planted_m.J, 0.05 * planted_m.J);
  EXPECT_NEAR(m.tau_coulomb, planted_m.tau_coulomb, 0.05 * planted_m.tau_coulomb);
  EXPECT_NEAR(m.tau_cogging, planted_m.tau_cogging, 0.05 * planted_m.tau_cogging);
  EXPECT_EQ(m.cogging_per_turn, planted_m.cogging_per_turn);
  // And what no log tells stays as it was.
  EXPECT_EQ(profile.drive.motor.psi_f, planted(3).base.drive.motor.psi_f);
}

TEST(MotorText, SaysWhereItsNumbersComeFromAndWhatIsMissing) {
  EXPECT_THAT(march_text(), ::testing::HasSubstr("# A: ±"));
  EXPECT_THAT(march_text(), ::testing::HasSubstr("march \\\"1\\\".log"));
  EXPECT_THAT(march_text(), ::testing::HasSubstr("#   torque constant: "));
  EXPECT_THAT(march_text(), ::testing::HasSubstr("which no log without a known torque shows"));
}

TEST(MotorText, ComesBackForTheNextTime) {
  const auto expected = emulator::expected_values(march_text(), "my.toml");
  ASSERT_FALSE(expected.empty());
  for (const auto& then : expected) {
    for (const auto& now : march().values) {
      if (now.quantity != then.quantity) continue;
      EXPECT_NEAR(then.estimate.value, now.estimate->value, 1e-5 * now.estimate->value);
    }
  }
  const auto changes = emulator::changes(march(), expected, "my.toml");
  EXPECT_THAT(changes.lines, ::testing::IsEmpty());
  EXPECT_GE(changes.compared, 3);
}

TEST(MotorText, TellsWhatHasChangedSince) {
  Planted worn = planted(3);
  worn.servo.profile.drive.mechanics.tau_coulomb *= 1.4;
  worn.servo.profile.drive.mechanics.tau_static *= 1.4;
  const auto may = identified(worn, 33);
  const auto lines =
      emulator::changes(may, emulator::expected_values(march_text(), "my.toml"), "my.toml").lines;
  ASSERT_THAT(lines, ::testing::SizeIs(1)) << ::testing::PrintToString(lines);
  EXPECT_THAT(lines.front(), ::testing::HasSubstr("drive 1: Coulomb friction is 4"));
  EXPECT_THAT(lines.front(), ::testing::HasSubstr("% more than in my.toml"));
}

TEST(MotorText, RefusesWhatIsNoFileOfIts) {
  const auto why = [](const std::string& text) -> std::string {
    try {
      emulator::expected_values(text, "my.toml");
    } catch (const emulator::ConfigError& problem) {
      return problem.what();
    }
    return "";
  };
  EXPECT_EQ(why("extends = \"mg4005\""),
            "my.toml: identified: is missing; lk-emu identify -o writes it");
  EXPECT_EQ(why("[identified]\ncoulomb_A = [1, 2]"),
            "my.toml:2: identified.coulomb_A: is not [value, low, high]");
  EXPECT_EQ(why("[identified]\ncoulomb_A = [1.0, 2.0, 3.0]"),
            "my.toml:2: identified.coulomb_A: is not [value, low, high] in that order");
  EXPECT_EQ(why("[identified]\ncoulomb_A = [\"a\", \"b\", \"c\"]"),
            "my.toml:2: identified.coulomb_A: is not [value, low, high] in that order");
  EXPECT_THAT(why("[identified\n"), ::testing::StartsWith("my.toml:1: "));
}

TEST(Report, NeedsNothingElseAndTrustsNoName) {
  const std::string html = emulator::identified_report({march()}, {"<script>.log"});
  EXPECT_THAT(html, ::testing::HasSubstr("&lt;script&gt;.log"));
  EXPECT_THAT(html, ::testing::Not(::testing::ContainsRegex("(src|href)=\"http")));
  EXPECT_THAT(html, ::testing::HasSubstr("<svg"));
  EXPECT_THAT(html, ::testing::HasSubstr("J and k_t only as a ratio"));
}

}  // namespace
}  // namespace lk::test
