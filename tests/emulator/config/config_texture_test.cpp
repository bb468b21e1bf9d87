// Stators, specimens and the current loop of a drive.

#include <gtest/gtest.h>

#include <cmath>

#include "emulator/config/stator.hpp"
#include "emulator/core/servo/lane.hpp"
#include "tests/emulator/config/config_support.hpp"
#include "tests/support/profile.hpp"

namespace lk::emulator {
namespace config_texture_test {

ServoConfig drive_of(const std::string& keys) {
  const std::string text = "[[bus]]\ninterface = \"vcan0\"\n[[bus.drive]]\nid = 1\n" + keys;
  return parse_config(text, "robot.toml", {}, test::profile)[0].servos[0];
}

std::string problem_of(const std::string& keys) {
  return config_error([&] { drive_of(keys); });
}

/// An MS4015: 24 slots, 26 poles, 24 cm³; docs/internals/model.md §15.
TEST(Stator, SetsTheCoggingOfADirectDrive) {
  model::DriveParams drive;
  drive.motor.pole_pairs = 13;
  set_texture({.slots = 24, .diameter = 0.040, .height = 0.015}, drive);
  EXPECT_NEAR(drive.mechanics.tau_cogging, 24 * 24.4 * 24e-6, 1e-9);
  EXPECT_NEAR(drive.mechanics.tau_pole_cogging, 26 * 11.2 * 24e-6, 1e-9);
  EXPECT_EQ(drive.mechanics.tau_cogging_3, 0);
  EXPECT_EQ(drive.mechanics.cogging_per_turn, 24);
}

TEST(Stator, YieldsToWhatTheDriveStates) {
  const ServoConfig servo =
      drive_of("profile.mechanics.tau_cogging_mNm = 1\nprofile.current_sensor.offset_a_A = 0.5");
  EXPECT_NEAR(servo.profile.drive.mechanics.tau_cogging, 1e-3, 1e-12);
  EXPECT_NEAR(servo.profile.drive.current_sensor.offset_a, 0.5, 1e-12);
  EXPECT_EQ(servo.profile.drive.mechanics.tau_pole_cogging, 0);
  EXPECT_EQ(servo.specimen, Specimen::kNominal);
}

TEST(Stator, OfADriveReplacesThatOfItsMotor) {
  const ServoConfig one = drive_of("");
  const ServoConfig two =
      drive_of("profile.stator = {slots = 72, diameter_mm = 70, height_mm = 15}");
  EXPECT_EQ(two.profile.drive.mechanics.cogging_per_turn, 72);
  EXPECT_NEAR(two.profile.drive.mechanics.tau_cogging, 2 * one.profile.drive.mechanics.tau_cogging,
              1e-9);
}

TEST(Specimen, DiffersByIdAndSeed) {
  ServoConfig servo = drive_of("");
  const auto tau = [&](std::uint64_t seed) {
    return make_drive(servo, seed).params.mechanics.tau_cogging;
  };
  const double nominal = servo.profile.drive.mechanics.tau_cogging;
  EXPECT_EQ(tau(1), tau(1));
  EXPECT_NE(tau(1), tau(2));
  const double of_id_1 = tau(1);
  servo.id = 2;
  EXPECT_NE(tau(1), of_id_1);
  for (std::uint64_t seed = 1; seed < 100; ++seed) EXPECT_NEAR(tau(seed), nominal, 0.12 * nominal);
  servo.specimen = Specimen::kNominal;
  EXPECT_EQ(tau(1), nominal);
}

/// The vector of the current sensors' offsets turns, and keeps its length within the spread.
TEST(Specimen, TurnsTheCurrentOffset) {
  const ServoConfig servo = drive_of("");
  const auto length = [](const model::CurrentSensorParams& s) {
    const double beta = (s.offset_a + 2 * s.offset_b) / std::sqrt(3.0);
    return std::hypot(s.offset_a, beta);
  };
  const double nominal = length(servo.profile.drive.current_sensor);
  ASSERT_GT(nominal, 0);
  double least = 1, most = -1;
  for (std::uint64_t seed = 1; seed < 100; ++seed) {
    const model::CurrentSensorParams sensor = make_drive(servo, seed).params.current_sensor;
    EXPECT_NEAR(length(sensor), nominal, 0.121 * nominal);
    least = std::min(least, sensor.offset_a);
    most = std::max(most, sensor.offset_a);
  }
  EXPECT_LT(least, -0.9 * nominal);
  EXPECT_GT(most, 0.9 * nominal);
}

TEST(CurrentLoop, IsSlowInLegacyDirectDrives) {
  const auto bandwidth = [](const std::string& keys) {
    return drive_of(keys).profile.drive.control.current_bandwidth;
  };
  EXPECT_EQ(bandwidth(""), 35);
  EXPECT_EQ(bandwidth("motor = \"mh9025\""), 35);
  EXPECT_EQ(bandwidth("generation = \"v236\""), 6283);
  EXPECT_EQ(bandwidth("motor = \"mg4005\""), 6283);
  EXPECT_EQ(bandwidth("quirks.current_loop = \"fast\""), 6283);
  EXPECT_EQ(bandwidth("generation = \"v236\"\nquirks.current_loop = \"slow\""), 35);
  EXPECT_EQ(bandwidth("profile.control.current_bandwidth_rad_s = 100"), 100);
}

TEST(Texture, RejectsWhatADriveCannotHave) {
  EXPECT_EQ(problem_of("specimen = \"best\""),
            "robot.toml:5: bus.drive.specimen: \"best\" is not one of nominal, drawn");
  EXPECT_EQ(problem_of("motor = \"ms3506\"\nquirks.current_loop = \"slow\""),
            "robot.toml:6: bus.drive.quirks.current_loop: MS drives have none");
  EXPECT_EQ(problem_of("quirks.current_loop = \"medium\""),
            "robot.toml:5: bus.drive.quirks.current_loop: \"medium\" is not one of fast, slow");
  EXPECT_EQ(problem_of("profile.stator.slots = 36"),
            "robot.toml:5: bus.drive.profile.stator.diameter_mm: missing");
}

}  // namespace config_texture_test
}  // namespace lk::emulator
