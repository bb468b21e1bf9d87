// Generations and quirks from the command line override the file.

#include <gtest/gtest.h>

#include "emulator/config/config_quirks.hpp"
#include "emulator/core/generation.hpp"
#include "tests/emulator/config/config_support.hpp"

namespace lk::emulator {
namespace asked_firmware_test {

const std::string kDrive = "[[bus]]\ninterface = \"vcan0\"\n[[bus.drive]]\nid = 1\n";

ServoConfig drive_of(const std::string& keys) { return parse(kDrive + keys)[0].servos[0]; }

Overrides asked(FirmwareRequest firmware) {
  Overrides overrides;
  overrides.firmware = std::move(firmware);
  return overrides;
}

TEST(RequestedFirmware, WinsOverTheFileKeyByKey) {
  const std::string text =
      kDrive + "generation = \"v236\"\nquirks = { pid_commands = true, stop_holds = true }\n";
  const auto drive = parse(text, asked({"v235", {{"pid_commands", "false"}}}))[0].servos[0];
  EXPECT_EQ(drive.generation, Generation::kV235);
  Quirks expected = quirks_of(Generation::kV235);
  expected.stop_holds = true;  // not overridden
  EXPECT_EQ(drive.quirks, expected);
  const auto same = parse(text, asked({std::nullopt, {{"state_1", "decivolt"}}}))[0].servos[0];
  EXPECT_EQ(same.generation, Generation::kV236);
  EXPECT_EQ(same.quirks.dialect.state_1, protocol::State1Layout::kDeciVolt);
  EXPECT_TRUE(same.quirks.dialect.pid_commands);
  const std::string geared = kDrive + "quirks.encoder_span = \"output_turn\"\n";
  EXPECT_EQ(
      parse(geared, asked({std::nullopt, {{"encoder_span", "rotor_turn"}}}))[0].servos[0].quirks,
      Quirks{})
      << "the motor's own again";
}

TEST(RequestedFirmware, SetsTheRangesOfTheSettings) {
  const std::string text = kDrive + "settings.max_torque_current_lsb = 2048\n";
  EXPECT_NE(parse_error(text), "accepted");
  EXPECT_EQ(parse(text, asked({"late-legacy", {}}))[0].servos[0].rom.max_torque_current_lsb, 2048);
}

TEST(RequestedFirmware, OfOneBusOverridesThatOfAllBuses) {
  Overrides overrides = asked({"v235", {{"stop_holds", "true"}, {"run_resumes", "true"}}});
  overrides.buses.push_back({"vcan0", std::vector{1}});
  overrides.buses.push_back({"vcan1", std::vector{1}, {"v236", {{"run_resumes", "false"}}}});
  for (const auto& buses :
       {default_config(overrides, find_test_profile), parse(kDrive, overrides)}) {
    ASSERT_EQ(buses.size(), 2U);
    const ServoConfig& first = buses[0].servos[0];
    const ServoConfig& second = buses[1].servos[0];
    EXPECT_EQ(first.generation, Generation::kV235);
    EXPECT_TRUE(first.quirks.stop_holds && first.quirks.run_resumes);
    EXPECT_EQ(second.generation, Generation::kV236);
    EXPECT_TRUE(second.quirks.stop_holds && !second.quirks.run_resumes);
  }
}

// The only bus of a file may run on another interface, and drives may be added to it.
TEST(RequestedFirmware, AppliesToMovedBusAndAddedDrives) {
  Overrides overrides;
  overrides.buses.push_back({"can7", std::vector{1, 9}, {"v236", {}}});
  const auto bus = parse(kDrive, overrides)[0];
  ASSERT_EQ(bus.servos.size(), 2U);
  for (const ServoConfig& servo : bus.servos) EXPECT_EQ(servo.generation, Generation::kV236);
}

TEST(RequestedFirmware, SeenDependsOnEachMotor) {
  Overrides overrides = asked({"seen", {}});
  overrides.motor = "mg4005";
  overrides.buses.push_back({"vcan0", std::vector{1, 2}});
  EXPECT_EQ(parse(kDrive, overrides)[0].servos[0].generation, Generation::kV236);
  EXPECT_EQ(parse(kDrive, overrides)[0].servos[1].generation, Generation::kV236);
}

TEST(RequestedFirmware, RejectsWhatAFileRejects) {
  struct Case {
    FirmwareRequest asked;
    const char* message;
  };
  for (const Case& c : {
           Case{
               {"v300", {}},
               "--generation: \"v300\" is not one of legacy, late-legacy, v235, v236, v236b, seen"},
           Case{{"", {}},
                "--generation: \"\" is not one of legacy, late-legacy, v235, v236, v236b, seen"},
           Case{{"seen", {}},
                "--generation: vcan0 drive 1 (mf7015): the generation of real drives of this motor "
                "is unknown; lk-emu motors lists the motors that have one"},
           Case{{"v2.35", {}},
                "--generation: \"v2.35\" is not one of legacy, late-legacy, v235, v236, v236b, "
                "seen, did "
                "you mean v235?"},
           Case{{"late_legacy", {}},
                "--generation: \"late_legacy\" is not one of legacy, late-legacy, v235, v236, "
                "v236b, seen, "
                "did you mean late-legacy?"},
           Case{
               {"v237", {}},
               "--generation: \"v237\" is not one of legacy, late-legacy, v235, v236, v236b, seen"},
           Case{{std::nullopt, {{"pid_command", "true"}}},
                "--quirk: pid_command: unknown key, did you mean pid_commands?"},
           Case{{std::nullopt, {{"pid_commands", "yes"}}},
                "--quirk: pid_commands: must be true or false"},
           Case{{std::nullopt, {{"pid_commands", ""}}},
                "--quirk: pid_commands: must be true or false"},
           Case{{std::nullopt, {{"state_1", "volt"}}},
                "--quirk: state_1: \"volt\" is not one of decivolt, centivolt, "
                "centivolt_and_bus_current"},
           Case{{std::nullopt, {{"single_turn_bits", "24"}}},
                "--quirk: single_turn_bits: must be 16 or 32"},
           Case{{std::nullopt, {{"reply_id_base", "0x280"}}},
                "--quirk: reply_id_base: must be 0x140 or 0x180"},
           Case{{std::nullopt, {{"reply_id_base", "0x"}}},
                "--quirk: reply_id_base: must be 0x140 or 0x180"},
           Case{{std::nullopt, {{"state_1", "1"}}},
                "--quirk: state_1: \"1\" is not one of decivolt, centivolt, "
                "centivolt_and_bus_current"},
           Case{{std::nullopt, {{"iq_scale", "true"}}},
                "--quirk: iq_scale: \"true\" is not one of manual, series"},
           Case{{std::nullopt, {{"single_turn_bits", "abc"}}},
                "--quirk: single_turn_bits: must be 16 or 32"},
           Case{{std::nullopt, {{"single_turn_bits", "true"}}},
                "--quirk: single_turn_bits: must be 16 or 32"},
           Case{{std::nullopt, {{"stop_holds", "1"}}},
                "--quirk: stop_holds: must be true or false"},
           Case{{std::nullopt, {{"open_loop_command", "true"}}},
                "--quirk: open_loop_command: MS drives only"},
           Case{{std::nullopt, {{"encoder_span\n", "1"}}},
                "--quirk: encoder_span?: unknown key, did you mean encoder_span?"},
       }) {
    EXPECT_EQ(config_error([&] { parse(kDrive, asked(c.asked)); }), c.message);
  }
  EXPECT_EQ(config_error([&] {
              parse(kDrive, asked({std::nullopt, {{"gear", "10"}}}));
            }).rfind("--quirk: gear: unknown; known: state_1, ", 0),
            0U);
}

TEST(RequestedFirmware, ReadsWordsAndNumbersOfAnyCase) {
  const Quirks quirks = parse(kDrive, asked({"V235",
                                             {{"reply_id_base", "0X180"},
                                              {"stop_holds", "True"},
                                              {"single_turn_bits", "32"},
                                              {"boot_wrap", "Half_Turn"}}}))[0]
                            .servos[0]
                            .quirks;
  Quirks expected = quirks_of(Generation::kV235);
  expected.dialect.reply_id_base = 0x180;
  expected.stop_holds = true;
  expected.dialect.wide_single_turn = true;
  expected.boot_wrap = BootWrap::kHalfTurn;
  EXPECT_EQ(quirks, expected);
  EXPECT_EQ(drive_of("generation = \"Late-Legacy\"").generation, Generation::kLateLegacy);
}

/// A robot whose first drives have an unknown generation.
const std::string kMixed =
    kDrive + "[[bus.drive]]\nid = 4\nmotor = \"mg4005\"\n[[bus]]\ninterface = \"vcan1\"\n" +
    "[[bus.drive]]\nid = 1\n";

TEST(RequestedFirmware, IgnoresDrivesThatDoNotRun) {
  Overrides overrides = asked({"seen", {}});
  overrides.buses.push_back({"vcan0", std::vector{4}});
  const auto buses = parse(kMixed, overrides);
  ASSERT_EQ(buses.size(), 1U);
  ASSERT_EQ(buses[0].servos.size(), 1U);
  EXPECT_EQ(buses[0].servos[0].generation, Generation::kV236);
  overrides.buses[0].ids = std::vector{1, 4};
  EXPECT_EQ(config_error([&] { parse(kMixed, overrides); }),
            "--generation: vcan0 drive 1 (mf7015): the generation of real drives of this motor is "
            "unknown; lk-emu motors lists the motors that have one");
}

TEST(RequestedFirmware, ErrorsNameTheCommandLine) {
  const std::string text = kDrive + "generation = \"v236\"\nsettings.gains.speed_kd = 1\n";
  EXPECT_EQ(parse_error(text), "accepted");
  const std::string problem =
      "robot.toml:6: bus.drive.settings.gains.speed_kd: only drives with parameter_commands have "
      "it";
  EXPECT_EQ(config_error([&] {
              parse(text, asked({"legacy", {}}));
            }),
            problem + " (with --generation legacy of the command line)");
  EXPECT_EQ(config_error([&] {
              parse(text, asked({std::nullopt, {{"parameter_commands", "false"}}}));
            }),
            problem + " (with --quirk parameter_commands=false of the command line)");
  EXPECT_EQ(config_error([&] {
              parse(kDrive + "reply_time_us = -1\n", asked({"v235", {}}));
            }),
            "robot.toml:5: bus.drive.reply_time_us: -1 is out of range (0 to 100000)")
      << "it is the file's";
}

TEST(RequestedBootAngle, OverridesTheFileForEveryDrive) {
  Overrides overrides;
  overrides.boot_angle_deg = -12.5;
  overrides.buses.push_back({"vcan0", std::vector{1, 2}});
  for (const auto& buses : {default_config(overrides, find_test_profile),
                            parse(kDrive + "boot_angle_deg = 90\n", overrides)}) {
    EXPECT_EQ(buses[0].servos[0].boot_angle_deg, -12.5);
    EXPECT_EQ(buses[0].servos[1].boot_angle_deg, -12.5) << "the file may not have it";
  }
  overrides.buses.clear();
  EXPECT_EQ(parse(kDrive, overrides)[0].servos[0].boot_angle_deg, -12.5);
}

TEST(RequestedBootAngle, RejectsWhatAFileRejects) {
  Overrides overrides;
  overrides.boot_angle_deg = 3000;
  EXPECT_EQ(config_error([&] { parse(kDrive, overrides); }),
            "--boot-angle: 3000 is out of range (-360 to 360, a turn of the output) of vcan0 drive "
            "1");
  EXPECT_EQ(parse(kDrive + "motor = \"mg4005\"\n", overrides).size(), 1U) << "1:10";
  overrides.boot_angle_deg = 20;
  const std::string stop = kDrive + "load = { theta_max_deg = 10 }\nboot_angle_deg = 0\n";
  EXPECT_EQ(parse_error(stop), "accepted");
  const std::string refused = config_error([&] { parse(stop, overrides); });
  EXPECT_TRUE(refused.ends_with(" (with --boot-angle 20 of the command line)")) << refused;
}

TEST(RequestedFirmware, MarksOnlyExplicitGenerationsAsGiven) {
  EXPECT_FALSE(drive_of("").generation_given);
  EXPECT_TRUE(drive_of("generation = \"legacy\"").generation_given);
  EXPECT_TRUE(parse(kDrive, asked({"legacy", {}}))[0].servos[0].generation_given);
}

}  // namespace asked_firmware_test
}  // namespace lk::emulator
