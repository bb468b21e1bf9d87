// Firmware generations and their quirks.

#include <gtest/gtest.h>

#include <cctype>
#include <cmath>
#include <functional>
#include <map>
#include <set>

#include "emulator/config/config_quirks.hpp"
#include "emulator/core/bus/bus.hpp"
#include "emulator/core/generation.hpp"
#include "emulator/core/units.hpp"
#include "protocol/wire.hpp"
#include "tests/emulator/config/config_support.hpp"
#include "tests/support/test_bus.hpp"

namespace lk::emulator {
namespace config_generation_test {

const std::string kDrive = "[[bus]]\ninterface = \"vcan0\"\n[[bus.drive]]\nid = 1\n";

ServoConfig drive_of(const std::string& keys) { return parse(kDrive + keys)[0].servos[0]; }

TEST(ConfigGeneration, IsAPresetOfSwitches) {
  EXPECT_EQ(drive_of("").generation, Generation::kLegacy);
  EXPECT_EQ(drive_of("").quirks, Quirks{});
  const auto late = drive_of("generation = \"late-legacy\"");
  EXPECT_EQ(late.generation, Generation::kLateLegacy);
  EXPECT_EQ(late.quirks.dialect, protocol::kLateLegacyDialect);
  EXPECT_TRUE(late.quirks.run_resumes);
  EXPECT_FALSE(late.quirks.off_needs_run);
  const auto v235 = drive_of("generation = \"v235\"");
  EXPECT_EQ(v235.generation, Generation::kV235);
  EXPECT_EQ(v235.quirks.dialect, protocol::kV235Dialect);
  EXPECT_FALSE(v235.quirks.run_resumes);
  EXPECT_TRUE(v235.quirks.off_needs_run);
  const auto v236 = drive_of("generation = \"v236\"");
  EXPECT_EQ(v236.generation, Generation::kV236);
  EXPECT_EQ(v236.quirks.dialect, protocol::kV236Dialect);
  EXPECT_FALSE(v236.quirks.run_resumes);
}

TEST(ConfigGeneration, EverySwitchIsSettableAlone) {
  using protocol::ClearAngleMeaning;
  using protocol::CurrentScale;
  using protocol::State1Layout;
  // Each line changes these quirks of `legacy`.
  const std::map<std::string, std::function<void(Quirks&)>> changes = {
      {"manual_reply_bytes = true", [](Quirks& q) { q.manual_reply_bytes = true; }},
      {"offset_write_takes_effect = false", [](Quirks& q) { q.offset_write_takes_effect = false; }},
      {"run_resumes = false", [](Quirks& q) { q.run_resumes = false; }},
      {"off_needs_run = true", [](Quirks& q) { q.off_needs_run = true; }},
      {"stop_holds = true", [](Quirks& q) { q.stop_holds = true; }},
      {"state_1 = \"centivolt\"", [](Quirks& q) { q.dialect.state_1 = State1Layout::kCentiVolt; }},
      {"state_1 = \"centivolt_and_bus_current\"",
       [](Quirks& q) { q.dialect.state_1 = State1Layout::kCentiVoltAndBusCurrent; }},
      {"single_turn_bits = 32", [](Quirks& q) { q.dialect.wide_single_turn = true; }},
      {"single_turn_target_bits = 32", [](Quirks& q) { q.dialect.wide_single_turn_target = true; }},
      {"pid_commands = false", [](Quirks& q) { q.dialect.pid_commands = false; }},
      {"offset_command = false", [](Quirks& q) { q.dialect.offset_command = false; }},
      {"clear_angle = \"implemented\"",
       [](Quirks& q) { q.dialect.clear_angle = ClearAngleMeaning::kImplemented; }},
      {"clear_angle = \"zero\"",
       [](Quirks& q) { q.dialect.clear_angle = ClearAngleMeaning::kZero; }},
      {"zero_stops = true", [](Quirks& q) { q.dialect.zero_stops = true; }},
      {"zero_reply_bits = 32", [](Quirks& q) { q.dialect.wide_zero_reply = true; }},
      {"max_torque_commands = false", [](Quirks& q) { q.dialect.max_torque_commands = false; }},
      {"setting_commands = true", [](Quirks& q) { q.dialect.setting_commands = true; }},
      {"restart_command = true", [](Quirks& q) { q.dialect.restart_command = true; }},
      {"calibrate_command = true", [](Quirks& q) { q.dialect.calibrate_command = true; }},
      {"parameter_ranges = true", [](Quirks& q) { q.dialect.parameter_ranges = true; }},
      {"id_change = \"save\"", [](Quirks& q) { q.id_change = IdChange::kSave; }},
      {"id_change = \"write\"", [](Quirks& q) { q.id_change = IdChange::kWrite; }},
      {"id_change_reply = \"new\"", [](Quirks& q) { q.id_change_reply = IdChangeReply::kNew; }},
      {"setting_read = \"active\"", [](Quirks& q) { q.setting_read = SettingRead::kActive; }},
      {"calibrate_busy = \"answers\"",
       [](Quirks& q) { q.calibrate_busy = CalibrateBusy::kAnswers; }},
      {"clear_angle = \"sets_angle\"",
       [](Quirks& q) { q.dialect.clear_angle = ClearAngleMeaning::kSetsAngle; }},
      {"speed_iq_limit = true", [](Quirks& q) { q.dialect.speed_iq_limit = true; }},
      {"brake_command = true", [](Quirks& q) { q.dialect.brake_command = true; }},
      {"parameter_commands = true", [](Quirks& q) { q.dialect.parameter_commands = true; }},
      {"multi_drive_more = true", [](Quirks& q) { q.dialect.multi_drive_more = true; }},
      {"all_error_bits = true", [](Quirks& q) { q.dialect.all_error_bits = true; }},
      {"iq_command_limit_lsb = 2048", [](Quirks& q) { q.dialect.iq_command_limit_lsb = 2048; }},
      {"iq_scale = \"series\"", [](Quirks& q) { q.dialect.iq_scale = CurrentScale::kSeries; }},
      {"phase_current_scale = \"series\"",
       [](Quirks& q) { q.dialect.phase_current_scale = CurrentScale::kSeries; }},
      {"boot_wrap = \"half_turn\"", [](Quirks& q) { q.boot_wrap = BootWrap::kHalfTurn; }},
      {"boot_multi_turn = \"zero\"", [](Quirks& q) { q.boot_multi_turn = BootMultiTurn::kZero; }},
      {"off_multi_turn = \"as_boot\"", [](Quirks& q) { q.off_multi_turn = OffMultiTurn::kAsBoot; }},
      {"state_on_byte = 48", [](Quirks& q) { q.dialect.state_on_byte = 0x30; }},
      {"off_hangs = \"bus\"", [](Quirks& q) { q.off_hangs = OffHangs::kBus; }},
      {"clear_reply = \"before\"", [](Quirks& q) { q.clear_reply = ClearReply::kBefore; }},
      {"encoder_span = \"output_turn\"",
       [](Quirks& q) { q.encoder_span = EncoderSpan::kOutputTurn; }},
      {"current_loop = \"fast\"", [](Quirks& q) { q.current_loop = CurrentLoopKind::kFast; }},
      {"encoder_bits = 16", [](Quirks& q) { q.encoder_bits = 16; }},
      {"reply_id_base = 0x180", [](Quirks& q) { q.dialect.reply_id_base = 0x180; }},
  };
  for (const auto& [line, change] : changes) {
    Quirks expected;
    change(expected);
    EXPECT_NE(expected, Quirks{}) << line;
    EXPECT_EQ(drive_of("quirks." + line).quirks, expected) << line;
    EXPECT_EQ(differing_switches(Generation::kLegacy, expected), std::vector{line});
  }
  Quirks open_loop;
  open_loop.dialect.open_loop_command = true;
  EXPECT_EQ(drive_of("motor = \"ms3506\"\nquirks.open_loop_command = true").quirks, open_loop);
}

TEST(ConfigGeneration, SwitchesOverrideThePreset) {
  const auto drive = drive_of(
      "generation = \"v236\"\n"
      "quirks = { state_1 = \"decivolt\", pid_commands = true, single_turn_bits = 16 }");
  Quirks expected = quirks_of(Generation::kV236);
  expected.dialect.state_1 = protocol::State1Layout::kDeciVolt;
  expected.dialect.pid_commands = true;
  expected.dialect.wide_single_turn = false;
  EXPECT_EQ(drive.quirks, expected);
}

TEST(ConfigGeneration, DoesNotDifferFromItself) {
  EXPECT_EQ(generation_names(),
            (std::vector<std::string>{"legacy", "late-legacy", "v235", "v236", "v236b"}));
  for (const std::string& name : generation_names()) {
    const ServoConfig drive = drive_of("generation = \"" + name + "\"");
    EXPECT_EQ(generation_name(drive.generation), name);
    EXPECT_EQ(differing_switches(drive.generation, drive.quirks), std::vector<std::string>{});
  }
}

// The columns of docs/reference/configuration.md that differ.
TEST(ConfigGeneration, PrintsDifferingSwitchesAsInAFile) {
  using Lines = std::vector<std::string>;
  EXPECT_EQ(
      differing_switches(Generation::kV236, quirks_of(Generation::kLegacy)),
      (Lines{"state_1 = \"decivolt\"", "single_turn_bits = 16", "single_turn_target_bits = 16",
             "pid_commands = true", "offset_command = true", "open_loop_command = false",
             "speed_iq_limit = false", "brake_command = false", "parameter_commands = false",
             "multi_drive_more = false", "all_error_bits = false", "max_torque_commands = true",
             "clear_angle = \"ignored\"", "iq_command_limit_lsb = 2000", "iq_scale = \"manual\"",
             "phase_current_scale = \"manual\"", "run_resumes = true", "off_needs_run = false"}));
  EXPECT_EQ(
      differing_switches(Generation::kLegacy, quirks_of(Generation::kLateLegacy)),
      (Lines{"single_turn_bits = 32", "iq_command_limit_lsb = 2048", "iq_scale = \"series\""}));
  EXPECT_EQ(differing_switches(Generation::kV235, quirks_of(Generation::kV236)),
            (Lines{"state_1 = \"centivolt_and_bus_current\"", "offset_command = false",
                   "speed_iq_limit = true", "brake_command = true", "parameter_commands = true",
                   "multi_drive_more = true", "clear_angle = \"sets_angle\"",
                   "phase_current_scale = \"series\""}));
}

TEST(ConfigGeneration, EncoderSpanOverridesTheMotors) {
  EXPECT_EQ(drive_of("").quirks.encoder_span, std::nullopt);
  EXPECT_EQ(drive_of("quirks.encoder_span = \"output_turn\"").quirks.encoder_span,
            EncoderSpan::kOutputTurn);
  EXPECT_EQ(drive_of("quirks.encoder_span = \"rotor_turn\"").quirks, Quirks{}) << "the motor's own";
}

// --- observed and requested on the command line

TEST(ConfigGeneration, SeenComesFromTheMotorFile) {
  const auto drive = drive_of("motor = \"mg4005\"\ngeneration = \"seen\"");
  EXPECT_EQ(drive.generation, Generation::kV236);
  EXPECT_EQ(drive.quirks, quirks_of(Generation::kV236));
  EXPECT_EQ(parse_error(kDrive + "generation = \"seen\""),
            "robot.toml:5: bus.drive.generation: the generation of real drives of this motor is "
            "unknown; lk-emu motors lists the motors that have one");
}

// --- start angle of the shaft

/// An MG4005-i10, whose encoder field spans a turn of the output.
const std::string kGeared = kDrive + "motor = \"mg4005\"\nquirks.encoder_span = \"output_turn\"\n";

/// Returns the start angle of the drive's output, in degrees.
double start_deg(const std::string& text) {
  const Bus bus(parse(text)[0]);
  return bus.truth(1).theta_out / kRadPerDeg;
}

TEST(ConfigStart, IsEqualInEveryGeneration) {
  for (const std::string& generation : generation_names()) {
    const std::string drive = kGeared + "generation = \"" + generation + "\"\n";
    EXPECT_NEAR(start_deg(drive + "settings.encoder_offset = 32768\nboot_angle_deg = 0"), 180,
                1e-3);
    EXPECT_NEAR(start_deg(drive + "settings.encoder_offset = 6000\nboot_angle_deg = -3600"),
                6000 * 360.0 / 65536 - 360, 1e-3);
    EXPECT_NEAR(start_deg(drive + "boot_angle_deg = 2000"), 200, 1e-3);
    EXPECT_EQ(start_deg(drive), start_deg(kGeared)) << "drawn";
  }
}

TEST(ConfigStart, ChecksEndStopsAgainstTheStartAngle) {
  for (const std::string& generation : generation_names()) {
    const std::string drive = kGeared + "generation = \"" + generation +
                              "\"\nsettings.encoder_offset = 32768\nboot_angle_deg = 0\n";
    EXPECT_EQ(parse_error(drive + "load = { theta_min_deg = 170, theta_max_deg = 190 }"),
              "accepted");
    EXPECT_EQ(
        parse_error(drive + "load = { theta_min_deg = -10, theta_max_deg = 10 }"),
        "robot.toml:10: bus.drive.load.theta_max_deg: the shaft starts beyond this end stop, at "
        "180 deg");
  }
}

TEST(ConfigStart, IsDrawnFromTheTurnOfTheEncoderField) {
  std::set<int> rotor_turns;
  for (int seed = 1; seed <= 40; ++seed) {
    const double out_deg = start_deg("seed = " + std::to_string(seed) + "\n" + kGeared);
    EXPECT_GT(out_deg, 0);
    EXPECT_LT(out_deg, 360);
    const double in_turn_deg = std::fmod(out_deg, 36) * 10;
    EXPECT_GE(in_turn_deg, 4.99) << "clear of the zero of each turn of the rotor";
    EXPECT_LE(in_turn_deg, 355.01);
    rotor_turns.insert(static_cast<int>(out_deg / 36));
    EXPECT_LT(start_deg("seed = " + std::to_string(seed) + "\n" + kDrive + "motor = \"mg4005\""),
              36);
  }
  EXPECT_GT(rotor_turns.size(), 7U);
  EXPECT_EQ(
      parse_error(kGeared + "load = { theta_min_deg = -1, theta_max_deg = 359 }"),
      "robot.toml:7: bus.drive.load.theta_max_deg: the drawn start may lie beyond this end stop: "
      "give boot_angle_deg");
  EXPECT_EQ(parse_error(kGeared + "load = { theta_min_deg = -1, theta_max_deg = 361 }"),
            "accepted");
}

TEST(ConfigStart, IsLimitedToOneOutputTurn) {
  EXPECT_EQ(parse_error(kGeared + "boot_angle_deg = 3600.1"),
            "robot.toml:7: bus.drive.boot_angle_deg: 3600.1 is out of range (-3600 to 3600)");
  EXPECT_EQ(parse_error(kDrive + "boot_angle_deg = 360.1"),
            "robot.toml:5: bus.drive.boot_angle_deg: 360.1 is out of range (-360 to 360)");
}

// Pairs observed on a real MG4005-i10.
TEST(ConfigStart, MatchesAnglesOfARealDrive) {
  struct Reading {
    const char* boot_deg;
    int angle_cdeg;
    int encoder;
    int half_turn_cdeg;
  };
  for (const Reading& reading :
       {Reading{"98.11", 9811, 1786, 9811}, Reading{"809.86", 80986, 14743, 8986},
        Reading{"674.25", 67425, 12274, -4575}, Reading{"8.92", 892, 162, 892}}) {
    const std::string drive =
        kGeared + "generation = \"v236\"\nboot_angle_deg = " + reading.boot_deg + "\n";
    test::Host host(parse(drive)[0]);
    const auto talk = [](test::Host& on, const char* text) {
      const auto replies = on.talk(test::frame(text), std::chrono::milliseconds(2));
      return replies.empty() ? protocol::Frame{} : replies[0];
    };
    const auto angle = talk(host, "141#9200000000000000");
    EXPECT_EQ(protocol::get_le<std::int32_t>(angle.data, 1), reading.angle_cdeg);
    EXPECT_EQ(protocol::get_le<std::uint16_t>(talk(host, "141#9C00000000000000").data, 6),
              reading.encoder);
    test::Host half(parse(drive + "quirks.boot_wrap = \"half_turn\"")[0]);
    EXPECT_EQ(protocol::get_le<std::int32_t>(talk(half, "141#9200000000000000").data, 1),
              reading.half_turn_cdeg);
    EXPECT_EQ(protocol::get_le<std::uint32_t>(talk(half, "141#9400000000000000").data, 4),
              static_cast<std::uint32_t>(reading.angle_cdeg));
  }
}

TEST(ConfigGeneration, DeterminesRegisterRanges) {
  EXPECT_EQ(drive_of("generation = \"v235\"\nsettings.max_torque_current_lsb = 2048")
                .rom.max_torque_current_lsb,
            2048);
  const auto wide = drive_of(
      "generation = \"v236\"\nsettings.gains = { speed_kp = 65535, angle_kd = 1, speed_kd = 2, "
      "current_kd = 3 }");
  EXPECT_EQ(wide.rom.gains.speed_kp, 65535);
  EXPECT_EQ(wide.rom.gains.angle_kd, 1);
  EXPECT_EQ(wide.rom.gains.speed_kd, 2);
  EXPECT_EQ(wide.rom.gains.current_kd, 3);
  EXPECT_EQ(
      drive_of("motor = \"ms3506\"\nsettings.max_power_permille = 500").rom.max_power_permille,
      500);
}

TEST(ConfigGeneration, BrakeRequiresTheBrakeCommand) {
  EXPECT_EQ(drive_of("generation = \"v236\"\nprofile.brake.tau_mNm = 500").profile.drive.brake.tau,
            0.5);
  EXPECT_EQ(drive_of("motor = \"braked\"\nquirks.brake_command = true").profile.drive.brake.tau, 1);
}

TEST(ConfigGeneration, ErrorsNameFileLineKeyAndReason) {
  const std::map<std::string, std::string> errors = {
      {"generation = \"v300\"",
       "robot.toml:5: bus.drive.generation: \"v300\" is not one of legacy, late-legacy, v235, "
       "v236, v236b, seen"},
      {"quirks.state_1 = \"volt\"",
       "robot.toml:5: bus.drive.quirks.state_1: \"volt\" is not one of decivolt, centivolt, "
       "centivolt_and_bus_current"},
      {"quirks.single_turn_bits = 24",
       "robot.toml:5: bus.drive.quirks.single_turn_bits: must be 16 or 32"},
      {"quirks.single_turn_target_bits = \"32\"",
       "robot.toml:5: bus.drive.quirks.single_turn_target_bits: must be 16 or 32"},
      {"quirks.iq_command_limit_lsb = 2049",
       "robot.toml:5: bus.drive.quirks.iq_command_limit_lsb: must be 2000 or 2048"},
      {"quirks.reply_id_base = 0x141",
       "robot.toml:5: bus.drive.quirks.reply_id_base: must be 0x140 or 0x180"},
      {"quirks.iq_scale = 1", "robot.toml:5: bus.drive.quirks.iq_scale: must be a string"},
      {"quirks.pid_command = true",
       "robot.toml:5: bus.drive.quirks.pid_command: unknown key, did you mean pid_commands?"},
      {"\nquirks.open_loop_command = true",
       "robot.toml:6: bus.drive.quirks.open_loop_command: MS drives only"},
      {"settings.max_torque_current_lsb = 2001",
       "robot.toml:5: bus.drive.settings.max_torque_current_lsb: 2001 is out of range (0 to 2000)"},
      {"generation = \"v235\"\nsettings.max_torque_current_lsb = 2049",
       "robot.toml:6: bus.drive.settings.max_torque_current_lsb: 2049 is out of range (0 to 2048)"},
      {"settings.max_power_permille = 1",
       "robot.toml:5: bus.drive.settings.max_power_permille: for MS drives only; use "
       "max_torque_current_lsb"},
      {"motor = \"ms3506\"\nsettings.max_torque_current_lsb = 1",
       "robot.toml:6: bus.drive.settings.max_torque_current_lsb: not for MS drives; use "
       "max_power_permille"},
      {"motor = \"ms3506\"\nsettings.max_power_permille = 851",
       "robot.toml:6: bus.drive.settings.max_power_permille: 851 is out of range (0 to 850)"},
      {"generation = \"v235\"\nsettings.gains.angle_kp = 256",
       "robot.toml:6: bus.drive.settings.gains.angle_kp: 256 is out of range (0 to 255)"},
      {"generation = \"v236\"\nsettings.gains.angle_kp = 65536",
       "robot.toml:6: bus.drive.settings.gains.angle_kp: 65536 is out of range (0 to 65535)"},
      {"settings.gains.speed_kd = 1",
       "robot.toml:5: bus.drive.settings.gains.speed_kd: only drives with parameter_commands have "
       "it"},
      {"generation = \"v235\"\nprofile.brake.tau_mNm = 500",
       "robot.toml:6: bus.drive.profile.brake: the drive has no command to release it; use "
       "generation v236 or quirks.brake_command = true"},
      {"motor = \"braked\"",
       "robot.toml:5: bus.drive.motor: has a brake, and the drive has no command to release it; "
       "use generation v236 or quirks.brake_command = true"},
  };
  for (const auto& [keys, error] : errors) EXPECT_EQ(parse_error(kDrive + keys), error) << keys;
}

}  // namespace config_generation_test
}  // namespace lk::emulator
