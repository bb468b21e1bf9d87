// Every shipped profile meets its vendor's printed figures, and its own numbers.
#include <map>

#include "tests/model/profiles.hpp"

namespace lk::model::test {
namespace print_test {

/// No-load speed at the output, rpm, and supply voltage, as printed by the vendors. MG6012-i36: not
/// printed.
const std::map<std::string, double> kPrintedNoLoadRpm{
    {"ms3506", 2100}, {"mf5010", 3050},   {"mf7015", 1895},   {"mf7015-23t", 805},
    {"mf9025", 710},  {"mh9025", 280},    {"mg4005", 320},    {"mg4010", 320},
    {"mg5010", 320},  {"mg6010", 505},    {"mg6012-i8", 310}, {"mg8008", 220},
    {"mg8016", 300},  {"mg4010-i36", 90}, {"rmd-x8-pro", 160}};

TEST(Print, MotorsReachTheirNoLoadSpeed) {
  std::size_t checked = 0;
  for (const std::vector<NamedDrive>& group : profiles_by_rate()) {
    DriveBank bank = bank_of(group);
    for (std::size_t n = 0; n < group.size(); ++n) {
      ControlSettings settings = group[n].init.settings;
      settings.omega_max = 1e4;
      bank.configure(n, settings);
      // More than friction and cogging: only the voltage limits the speed.
      const DriveParams& d = group[n].init.params;
      const MechanicsParams& m = d.mechanics;
      if (d.control.has_current_loop) {
        const double tau = 2.5 * m.tau_coulomb + 1.5 * (m.tau_cogging + m.tau_pole_cogging);
        bank.command(n, Torque{tau / k_t(d.motor)});
      } else {
        bank.command(n, Speed{1e4});  // within Max Power, which limits such drives
      }
    }
    bank.advance(ticks_in(group.front().init.params, 4.0));
    for (std::size_t n = 0; n < group.size(); ++n) {
      const auto printed = kPrintedNoLoadRpm.find(group[n].name);
      if (printed == kPrintedNoLoadRpm.end()) {
        continue;
      }
      ++checked;
      const double rpm = bank.truth(n).omega_out * 60.0 / (2.0 * kPiT);
      EXPECT_NEAR(rpm, printed->second, 0.03 * printed->second) << group[n].name;  // required: 3 %
    }
  }
  EXPECT_EQ(checked, kPrintedNoLoadRpm.size());
}

/// Motors whose printed rated point is at the voltage limit: requirement 3 %.
TEST(Print, MotorsReachTheirRatedPoint) {
  for (const NamedDrive& drive : all_profiles()) {
    if (drive.name != "ms3506" && drive.name != "mh9025") continue;
    const emulator::Rating rating = lk::test::profile(drive.name).rating;
    DriveInit init = drive.init;
    init.params.load.tau = -rating.torque_rated_Nm;
    init.params.thermal.C_winding = 1e6;  // cold
    DriveBank bank(std::span(&init, 1));
    bank.command(0, Speed{1e3});
    bank.advance(ticks_in(init.params, 3.0));
    EXPECT_NEAR(bank.truth(0).omega_out * 60.0 / (2.0 * kPiT), rating.speed_rated_rpm,
                0.03 * rating.speed_rated_rpm)
        << drive.name;
  }
}

/// Reported motor temperature an hour after power-up at 25 °C ambient: real drives show 31 to 42 °C
/// at rest.
TEST(Print, MotorsAreWarmAtRest) {
  for (const NamedDrive& drive : all_profiles()) {
    DriveInit init = drive.init;
    // Small heat capacities shorten the hour to two seconds; the end state is unchanged.
    for (double* C : {&init.params.thermal.C_winding, &init.params.thermal.C_housing,
                      &init.params.thermal.C_stage}) {
      *C *= 2.0 / 3600.0;
    }
    DriveBank bank(std::span(&init, 1));
    EXPECT_EQ(bank.telemetry(0).temp_motor, 25.0) << drive.name;
    bank.advance(ticks_in(init.params, 2.0));
    EXPECT_GE(bank.telemetry(0).temp_motor, 31.0) << drive.name;
    EXPECT_LE(bank.telemetry(0).temp_motor, 42.0) << drive.name;
  }
}

TEST(Print, MotorsStartAtTheGivenTemperature) {
  DriveInit init = all_profiles().front().init;
  init.temp = -10.0;
  DriveBank bank(std::span(&init, 1));
  bank.advance(1);
  EXPECT_NEAR(bank.truth(0).temp_winding, -10.0, 1e-3);
  EXPECT_NEAR(bank.truth(0).temp_housing, -10.0, 1e-3);
  EXPECT_NEAR(bank.truth(0).temp_stage, -10.0, 1e-3);
}

TEST(Print, TableNamesShippedMotors) {
  std::vector<std::string> names;
  for (const NamedDrive& drive : all_profiles()) {
    names.push_back(drive.name);
  }
  for (const auto& [name, rpm] : kPrintedNoLoadRpm) {
    EXPECT_NE(std::find(names.begin(), names.end(), name), names.end()) << name;
  }
  EXPECT_NE(std::find(names.begin(), names.end(), "mg6012-i36"), names.end());
}

}  // namespace print_test
}  // namespace lk::model::test
