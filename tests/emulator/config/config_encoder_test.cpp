// The encoder field by label, generation, file and option.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "emulator/config/config_quirks.hpp"
#include "emulator/core/servo/shaft_angles.hpp"
#include "tests/emulator/config/config_support.hpp"
#include "tests/support/profile.hpp"

namespace lk::emulator {
namespace config_encoder_test {

const std::string kDrive = "[[bus]]\ninterface = \"vcan0\"\n[[bus.drive]]\nid = 1\n";

/// Finds a shipped motor as by this label; "LABEL=NAME".
Profile find_labelled(const std::string& motor) {
  const std::size_t mark = motor.find('=');
  MotorFile file = test::motor_file(motor.substr(mark + 1));
  if (mark != std::string::npos) file.label = motor.substr(0, mark);
  return parse_profile(file, test::motor_file);
}

ServoConfig drive_of(const std::string& motor, const std::string& keys) {
  const std::string text = kDrive + "motor = \"" + motor + "\"\n" + keys;
  return parse_config(text, "robot.toml", {}, find_labelled)[0].servos[0];
}

int bits_of(const std::string& motor, const std::string& keys) {
  return wire_bits(drive_of(motor, keys).profile.drive.encoder);
}

TEST(LabelFacts, ReadGearWindingEncoderAndPrint) {
  const LabelFacts geared = label_facts("MG5010E-i36v3");
  EXPECT_EQ(geared.gear, 36);
  EXPECT_EQ(geared.encoder_span, EncoderSpan::kOutputTurn);
  EXPECT_EQ(geared.winding, "");
  EXPECT_FALSE(geared.later_print);
  EXPECT_EQ(label_facts("mg4005-i10").encoder_span, EncoderSpan::kRotorTurn);
  EXPECT_EQ(label_facts("MG4005v3-i10").encoder_span, EncoderSpan::kRotorTurn);
  EXPECT_EQ(label_facts("MG8016E").encoder_span, EncoderSpan::kOutputTurn);
  EXPECT_EQ(label_facts("mg5010").encoder_span, std::nullopt) << "a file's name";
  EXPECT_EQ(label_facts("mg4005-14p").encoder_span, std::nullopt) << "a file's name";
  EXPECT_EQ(label_facts("RMD-X8").encoder_span, std::nullopt);
  EXPECT_EQ(label_facts("MF9025v2-16T").winding, "16t");
  for (const char* const later :
       {"MF9025v2", "mf9025v2-35t", "MF7015V2-10T", "MF4005-V2", "MHF7015"}) {
    EXPECT_TRUE(label_facts(later).later_print) << later;
  }
  for (const char* const early :
       {"MF9025-16T", "MF7015v1-24V-23T", "MHF9025", "MG4005v2-i10", ""}) {
    EXPECT_FALSE(label_facts(early).later_print) << early;
  }
}

// docs/start/which-drive.md, Find your motor's label.
TEST(EncoderBits, FollowLabelAndGeneration) {
  for (const char* const later : {"late-legacy", "v235", "v236", "v236b"}) {
    const std::string generation = "generation = \"" + std::string(later) + "\"\n";
    EXPECT_EQ(bits_of("mf9025", generation), 16) << later;
    EXPECT_EQ(bits_of("mh9025", generation), 14) << "the print of its series";
    EXPECT_EQ(bits_of("MHF7015=mhf7015", generation), 16);
    EXPECT_EQ(bits_of("mg4005", generation), 16);
  }
  EXPECT_EQ(bits_of("mf9025", ""), 14);
  EXPECT_EQ(bits_of("MF9025-16T=mf9025", ""), 14);
  EXPECT_EQ(bits_of("MF9025v2-16T=mf9025", ""), 16);
  EXPECT_EQ(bits_of("MHF7015=mhf7015", ""), 16);
  EXPECT_EQ(bits_of("ms4010", ""), 16);
}

TEST(EncoderBits, OptionOverridesProfileOverridesLabel) {
  const std::string late = "generation = \"v236\"\n";
  EXPECT_EQ(bits_of("mf9025", late + "profile.encoder.bits = 14\n"), 14);
  EXPECT_EQ(bits_of("mf9025", "profile.encoder.bits = 12\n"), 12);
  EXPECT_EQ(bits_of("mf9025", late + "profile.encoder.bits = 14\nquirks.encoder_bits = 16\n"), 16);
  EXPECT_EQ(bits_of("mf9025", late + "quirks.encoder_bits = 14\n"), 14);
  EXPECT_EQ(bits_of("MF9025v2=mf9025", "quirks.encoder_bits = 14\n"), 14);
  EXPECT_EQ(bits_of("mh9025", "quirks.encoder_bits = 16\n"), 16);
  Overrides overrides;
  overrides.firmware.quirks = {{"encoder_bits", "16"}};
  const std::string text = kDrive + "motor = \"mf9025\"\nquirks.encoder_bits = 14\n";
  const auto asked = parse_config(text, "robot.toml", overrides, find_labelled)[0].servos[0];
  EXPECT_EQ(asked.profile.drive.encoder.bits, 18);
}

TEST(EncoderBits, IsASwitchOnlyIfItDiffers) {
  const auto differing = [](const std::string& keys) {
    const ServoConfig servo = drive_of("mf9025", keys);
    return differing_switches(servo.generation, servo.quirks);
  };
  using Lines = std::vector<std::string>;
  EXPECT_EQ(differing("quirks.encoder_bits = 16\n"), Lines{"encoder_bits = 16"});
  EXPECT_EQ(differing("quirks.encoder_bits = 14\n"), Lines{});
  EXPECT_EQ(differing("generation = \"v235\"\nquirks.encoder_bits = 14\n"),
            Lines{"encoder_bits = 14"});
}

TEST(EncoderBits, RejectsWhatTheMotorDoesNotHave) {
  const auto error = [](const std::string& motor, const std::string& value) {
    return config_error([&] { drive_of(motor, "quirks.encoder_bits = " + value + "\n"); });
  };
  EXPECT_EQ(error("mg4005", "14"),
            "robot.toml:6: bus.drive.quirks.encoder_bits: mg4005 has 16 only: MG drives show the "
            "upper 16 of 18 bits; MF and MH have 14 or 16");
  EXPECT_EQ(error("ms4010", "14"),
            "robot.toml:6: bus.drive.quirks.encoder_bits: ms4010 has 16 only: MS drives show the "
            "upper 16 of 18 bits; MF and MH have 14 or 16");
  EXPECT_EQ(error("mf9025", "18"), "robot.toml:6: bus.drive.quirks.encoder_bits: must be 14 or 16");
  EXPECT_EQ(error("mg4005", "16"), "accepted");
  Overrides overrides;
  overrides.firmware.quirks = {{"encoder_bits", "14"}};
  const std::string text = kDrive + "motor = \"mg4005\"\n";
  EXPECT_EQ(config_error([&] { parse_config(text, "robot.toml", overrides, find_labelled); }),
            "--quirk: encoder_bits: mg4005 has 16 only: MG drives show the upper 16 of 18 bits; MF "
            "and MH have 14 or 16");
}

TEST(EncoderSpan, FollowsTheLabel) {
  const auto span = [](const std::string& motor, const std::string& keys = "") {
    return encoder_turns(drive_of(motor, keys).profile, drive_of(motor, keys).quirks);
  };
  EXPECT_EQ(span("MG5010E-i10=mg5010"), 10);
  EXPECT_EQ(span("MG5010-i10=mg5010"), 1);
  EXPECT_EQ(span("mg5010"), 1) << "as its file";
  EXPECT_EQ(span("MG4005-i10=mg4005"), 1);
  EXPECT_EQ(span("MG4005E-i10=mg4005"), 10);
  EXPECT_EQ(span("mg4005"), 10) << "as its file";
  EXPECT_EQ(span("MG4005E-i10=mg4005", "quirks.encoder_span = \"rotor_turn\"\n"), 1);
}

/// A file that extends a label means that label.
TEST(EncoderSpan, IsInheritedFromTheLabel) {
  const FindMotorFile find = [](const std::string& motor) {
    MotorFile file = test::motor_file(motor.starts_with("MG") ? "mg5010" : "mf9025");
    file.label = motor;
    return file;
  };
  const auto mine = [&](const std::string& text) { return parse_profile({"m", "m", text}, find); };
  EXPECT_EQ(mine("extends = \"MG5010E-i10\"\n").encoder_span, EncoderSpan::kOutputTurn);
  EXPECT_EQ(mine("extends = \"MG5010E-i10\"\nencoder_span = \"rotor_turn\"\n").encoder_span,
            EncoderSpan::kRotorTurn);
  EXPECT_TRUE(mine("extends = \"MF9025v2\"\n").later_print);
  EXPECT_FALSE(mine("extends = \"mf9025\"\n").later_print);
}

/// Printed torque constants are volts over the no-load speed, which is 2/√3 of the torque over the
/// amplitude of the phase currents. Tolerance: half of the last printed digit.
TEST(TorqueConstant, OfHostsFitsTheFlux) {
  for (const auto& [motor, half_digit] : {std::pair{"mf9025", 0.005},
                                          {"mf7015", 0.005},
                                          {"mg4010", 0.05},
                                          {"mg4010-i36", 0.005},
                                          {"mg8010-i36", 0.005 * 36},
                                          {"mhf7015", 0.005}}) {
    const Profile profile = test::profile(motor);
    const model::DriveParams& drive = profile.drive;
    const double k_t =
        1.5 * drive.motor.pole_pairs * drive.motor.psi_f * drive.mechanics.gear_ratio;
    EXPECT_NEAR(k_t * 2 / std::numbers::sqrt3, profile.rating.torque_constant_Nm_A, half_digit)
        << motor;
  }
}

}  // namespace config_encoder_test
}  // namespace lk::emulator
