// Combinations of keys that are each valid but contradict each other.

#include <gtest/gtest.h>

#include <map>

#include "tests/emulator/config/config_support.hpp"

namespace lk::emulator {
namespace config_checks_test {

const std::string kDrive = "[[bus]]\ninterface = \"vcan0\"\n[[bus.drive]]\nid = 1\n";

TEST(ConfigChecks, RejectContradictionsWithTheirLine) {
  const std::string under = "settings.protection.under_voltage = ";
  const std::string over = "settings.protection.over_voltage = ";
  const std::map<std::string, std::string> errors = {
      {"profile.control.has_current_loop = false",
       "5: bus.drive.profile.control.has_current_loop: must be true: only MS drives have no "
       "current "
       "loop"},
      {"motor = \"ms3506\"\nprofile.control.has_current_loop = true",
       "6: bus.drive.profile.control.has_current_loop: must be false: an MS drive measures no "
       "current"},
      {under + "{ enabled = true, threshold_V = 7 }\nprofile.logic.reset_V = 7",
       "5: bus.drive.settings.protection.under_voltage.threshold_V: under-voltage at 7 V is never "
       "reported: the controller does not start below 7.5 V"},
      {under + "{ enabled = true }\nprofile.logic.reset_V = 7",
       "6: bus.drive.profile.logic.reset_V: under-voltage at 0 V is never reported: the controller "
       "does not start below 7.5 V"},
      {under + "{ enabled = true, threshold_V = 5 }",
       "5: bus.drive.settings.protection.under_voltage.threshold_V: under-voltage at 5 V is never "
       "reported: the controller does not start below 5.5 V"},
      {"motor = \"protected\"\nprofile.logic.reset_V = 12",
       "6: bus.drive.profile.logic.reset_V: under-voltage at 12 V is never reported: the "
       "controller "
       "does not start below 12.5 V"},
      {"motor = \"protected\"\n" + over + "{ enabled = true, threshold_V = 12 }",
       "6: bus.drive.settings.protection.over_voltage.threshold_V: over-voltage at 12 V must be "
       "above "
       "under-voltage at 12 V: one of them would always be there"},
      {"settings.protection.stall = { enabled = true, threshold_s = 2, hysteresis_s = 2.5 }",
       "5: bus.drive.settings.protection.stall.hysteresis_s: stall could never be cleared: its "
       "hysteresis, 2.5, must not be above its threshold, 2"},
      {over + "{ enabled = true, threshold_V = 30, hysteresis_V = 31 }",
       "5: bus.drive.settings.protection.over_voltage.hysteresis_V: over_voltage could never be "
       "cleared: its hysteresis, 31, must not be above its threshold, 30"},
      {"motor = \"ms3506\"\nsettings.broadcast_mode = true",
       "6: bus.drive.settings.broadcast_mode: the drive would answer no frame: MS drives do not "
       "have 0x280; set quirks.multi_drive_more = true for the other multi-drive commands"},
      {"generation = \"v236\"\nprofile.brake.tau_mNm = 500\nsettings.broadcast_mode = true",
       "7: bus.drive.settings.broadcast_mode: the brake cannot be released: in multi-drive mode "
       "0x8C comes in 0x288 with a payload of zeros, which engages it"},
      {"generation = \"v236\"\nprofile.brake.engage_ms = 1",
       "6: bus.drive.profile.brake: missing tau_mNm: without it the drive has no brake"},
      {"settings.encoder_offset = 4096\nprofile.encoder.bits = 12",
       "5: bus.drive.settings.encoder_offset: does not fit the encoder of this motor (12 bit on "
       "the "
       "wire)"},
      {"motor = \"protected\"\nprofile.encoder.bits = 12",
       "6: bus.drive.profile.encoder.bits: does not fit the encoder of this motor (12 bit on the "
       "wire)"},
      {"profile.supply.i_logic_mA = 0",
       "5: bus.drive.profile.supply.i_logic_mA: 0 is out of range (1 to 2000)"},
  };
  for (const auto& [keys, error] : errors) {
    EXPECT_EQ(parse_error(kDrive + keys), "robot.toml:" + error) << keys;
  }
}

/// docs/internals/model.md gives the range of its equations. Limits by hand, for the defaults of
/// model/drive_params.hpp: 32 kHz, 0.14 + 0.01 ohm.
TEST(ConfigChecks, RejectMotorsOutsideTheModelRange) {
  const std::string springy =
      "motor = \"mg4005\"\nprofile.mechanics = { gear_stiffness_Nm_rad = 2500, ";
  const std::string winding =
      "L_d_mH and L_q_mH must be above 4 * (R_s_ohm + R_on_mohm / 1000) / f_pwm_kHz: above ";
  const std::string stiff =
      " times too stiff for what it moves, at this f_pwm_kHz: raise J_out_g_cm2 or J_g_cm2, or "
      "lower gear_stiffness_Nm_rad or gear_damping_Nm_s_rad (0 and 0: rigid)";
  const std::map<std::string, std::string> errors = {
      // 4 * 0.15 / 32 mH and 4 * 1.04 / 32 mH
      {"profile.motor.L_d_mH = 0.0187",
       "5: bus.drive.profile.motor.L_d_mH: " + winding + "0.01875 mH, and one is 0.0187"},
      {"profile.motor = { R_s_ohm = 1.03, L_d_mH = 1, L_q_mH = 0.001 }",
       "5: bus.drive.profile.motor.L_q_mH: " + winding + "0.13 mH, and one is 0.001"},
      {springy + "J_out_g_cm2 = 0 }\nload.J_g_cm2 = 1000",
       "6: bus.drive.profile.mechanics.J_out_g_cm2: J_out_g_cm2 must be above 0, for a springy "
       "gear "
       "moves it; or make the gear rigid, gear_stiffness_Nm_rad = 0"},
      // 2500 / (1e-6 * 32e3^2) = 2.4414, and 0.0003 for the rotor's 100 * 9.33e-5 kg m^2
      {springy + "J_out_g_cm2 = 10 }",
       "6: bus.drive.profile.mechanics.J_out_g_cm2: the gear is 2.442" + stiff},
      // With a negligible spring, 2 * 2 / (1e-4 * 32e3) = 1.25, and 0.0134 for the rotor
      {"motor = \"mg4005\"\nprofile.mechanics = { gear_stiffness_Nm_rad = 1e-6, "
       "gear_damping_Nm_s_rad = 2, J_out_g_cm2 = 1000 }",
       "6: bus.drive.profile.mechanics.J_out_g_cm2: the gear is 1.263" + stiff},
  };
  for (const auto& [keys, error] : errors) {
    EXPECT_EQ(parse_error(kDrive + keys), "robot.toml:" + error) << keys;
  }
  for (const std::string& keys :
       {std::string("profile.control.estimator_bandwidth_rad_s = 100000"),
        std::string("profile.motor = { L_d_mH = 0.0188, L_q_mH = 0.0188 }"),
        springy + "J_out_g_cm2 = 25 }"}) {
    EXPECT_EQ(parse_error(kDrive + keys), "accepted") << keys;
  }
}

TEST(ConfigChecks, AcceptSeemingContradictions) {
  for (const char* keys : {
           "profile.control.has_current_loop = true",
           "motor = \"ms3506\"\nprofile.control.has_current_loop = false",
           "settings.protection.under_voltage = { enabled = false, threshold_V = 5 }",
           "settings.protection.under_voltage = { enabled = true, threshold_V = 5.6 }",
           "motor = \"protected\"\nsettings.protection.over_voltage.threshold_V = 12",  // off
           "settings.protection.stall = { enabled = true, threshold_s = 2, hysteresis_s = 2 }",
           "settings.protection.stall = { threshold_s = 2, hysteresis_s = 3 }",  // off
           ("settings.protection.short_circuit = { enabled = true, recoverable = false, "
            "threshold_A = 2, hysteresis_A = 3 }"),  // a restart clears it
           "motor = \"ms3506\"\ngeneration = \"v236\"\nsettings.broadcast_mode = true",
           "generation = \"v236\"\nprofile.brake.tau_mNm = 0",
           "motor = \"braked\"\ngeneration = \"v236\"\nprofile.brake.engage_ms = 1",
           "motor = \"protected\"\nprofile.encoder.bits = 13",
       }) {
    EXPECT_EQ(parse_error(kDrive + keys), "accepted") << keys;
  }
}

/// The file has no entry for the drive, but its motor may come from a user.
TEST(ConfigChecks, CoverTheMotorOfTheCommandLine) {
  Overrides overrides;
  overrides.motor = "braked";
  overrides.buses.push_back({"vcan0", std::vector{1}});
  const auto problem = [&] {
    return config_error([&] { default_config(overrides, find_test_profile); });
  };
  EXPECT_EQ(problem(),
            "--motor: braked: has a brake, and the drive has no command to release it; use "
            "generation v236 or quirks.brake_command = true");
  overrides.firmware.generation = "v236";
  EXPECT_EQ(problem(), "accepted");
}

}  // namespace config_checks_test
}  // namespace lk::emulator
