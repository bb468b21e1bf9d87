// Visibility of each plant fault: on a cold drive at rest, on a warm one, on a turning one, and
// without power.

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <string_view>
#include <vector>

#include "tests/emulator/core/faults/fault_support.hpp"

namespace lk::emulator {
namespace plant_fault_evidence_test {

using namespace std::chrono_literals;
using test::Host;

/// By the fault's description and the drive's behaviour. At rest no current flows and the shaft
/// does not turn. A controller without power reads no sensor.
struct Shows {
  std::vector<FaultValue> values;
  bool cold, warm, running, unpowered;
};
const std::map<std::string_view, Shows> kShows = {
    {"encoder_stuck", {{}, false, false, true, false}},
    {"encoder_jump", {{10}, true, true, true, false}},
    {"encoder_noise", {{1}, true, true, true, false}},
    {"encoder_drift", {{90}, true, true, true, false}},
    {"encoder_garbage", {{}, true, true, true, false}},
    {"encoder_lost_magnet", {{}, true, true, true, false}},
    {"encoder_slow", {{10}, false, false, true, false}},
    {"current_offset", {{1}, true, true, true, false}},
    {"current_gain", {{0.5}, false, false, true, false}},
    {"current_noise", {{0.5}, true, true, true, false}},
    {"current_stuck", {{}, false, false, true, false}},
    {"temperature_stuck", {{80}, true, true, true, false}},
    {"temperature_off", {{10}, true, true, true, false}},
    {"voltage_stuck", {{20}, true, true, true, false}},
    {"voltage_off", {{-2}, true, true, true, false}},
    {"phase_open", {{}, false, false, true, false}},
    {"switch_open", {{}, false, false, true, false}},
    {"switch_shorted", {{}, false, false, true, false}},
    {"bridge_dead", {{}, false, false, true, false}},
    {"calibration_lost", {{}, false, false, true, false}},
    {"jam", {{}, false, false, true, false}},
    {"friction", {{3}, false, false, true, false}},
    {"inertia", {{3}, false, false, true, false}},
    {"load_step", {{20}, true, true, true, true}},  // friction and brake hold 10.5 Nm
    {"kick", {{0.1}, true, true, true, true}},
    {"backlash", {{3}, false, false, true, false}},
    {"coupling_broken", {{}, false, false, true, false}},
    {"end_stop", {{-5, 5}, false, false, true, false}},
    {"brake_late", {{}, false, false, false, false}},  // the coil is not switched
    {"fan_stuck", {{2}, false, true, true, false}},
    {"sag", {{15}, true, true, true, false}},
    {"dip", {{}, true, true, true, false}},
    {"cut", {{}, true, true, true, false}},
    {"reboot_loop", {{}, true, true, true, false}},
    {"no_regeneration", {{}, false, false, false, false}},  // no braking
    {"clock_drift", {{10}, false, false, true, false}},
};

bool is_of_plant(const FaultRow& row) {
  return row.plant != nullptr ||
         (row.group >= FaultGroup::kSensors && row.group <= FaultGroup::kPower);
}

/// Geared with play, friction and a brake; at rest at ambient temperature.
ServoConfig drive() {
  ServoConfig servo = test::powered_drive();
  model::DriveParams& d = servo.profile.drive;
  d.mechanics.gear_ratio = 10;
  d.mechanics.backlash_out = 0.02;
  d.mechanics.gear_stiffness_out = 500;
  d.mechanics.gear_damping_out = 0.5;
  d.mechanics.J_out = 1e-3;
  d.mechanics.tau_coulomb = d.mechanics.tau_static = 0.05;
  d.load.J = 0.02;
  d.brake.tau = 1;
  servo.quirks.dialect.brake_command = true;
  servo.rom.acceleration_dps_s = 2000;
  return servo;
}

/// Returns whether it has taken effect half a second after its start.
bool shows(Host host, std::string_view kind, const std::vector<FaultValue>& values) {
  Fault fault = test::fault_of(kind, {}, {1});
  std::ranges::copy(values, fault.values.begin());
  host.bus.apply({kWholeBus, SetFault{fault}});
  host.wait(500ms);
  return test::evidence(host).effects > 0;
}

class PlantFaultEvidence : public testing::TestWithParam<std::string_view> {};

TEST_P(PlantFaultEvidence, IsThereWhereTheFaultShows) {
  const auto found = kShows.find(GetParam());
  ASSERT_NE(found, kShows.end()) << "no row says where it shows";
  const Shows& expected = found->second;
  const auto is_shown = [&](const Host& host) { return shows(host, GetParam(), expected.values); };

  Host cold(drive());
  cold.wait(100ms);  // booted
  cold.ask("141#8000000000000000");
  EXPECT_EQ(is_shown(cold), expected.cold) << "cold";

  ServoConfig at_60_C = drive();
  at_60_C.boot_temperature_C = 60;
  Host warm(at_60_C);
  warm.wait(100ms);
  warm.ask("141#8000000000000000");
  EXPECT_EQ(is_shown(warm), expected.warm) << "warm";

  Host running(drive());
  running.wait(100ms);
  running.ask("141#8C01000000000000");
  running.ask("141#A2000000407E0500");  // 3600 dps
  running.wait(2s);
  running.ask("141#A200000080FC0A00");  // 7200 dps, in 1.8 s
  EXPECT_EQ(is_shown(running), expected.running) << "running";

  Host unpowered(drive());
  unpowered.wait(100ms);
  unpowered.bus.apply({1, PowerOff{}});
  unpowered.wait(1s);
  ASSERT_FALSE(unpowered.bus.telemetry(1).alive);
  EXPECT_EQ(is_shown(unpowered), expected.unpowered) << "unpowered";
}

std::vector<std::string_view> words() {
  std::vector<std::string_view> words;
  for (const FaultRow& row : fault_table()) {
    if (is_of_plant(row)) words.push_back(row.word);
  }
  return words;
}
INSTANTIATE_TEST_SUITE_P(Faults, PlantFaultEvidence, testing::ValuesIn(words()),
                         [](const auto& word) { return std::string(word.param); });

TEST(PlantFaults, AreAllInTheTableOfEvidence) { EXPECT_EQ(kShows.size(), words().size()); }

/// A hot motor also cools without power.
TEST(FanStuck, ShowsOnAWarmDriveWithoutPower) {
  ServoConfig servo = drive();
  servo.boot_temperature_C = 60;
  Host host(servo);
  host.bus.apply({1, PowerOff{}});
  host.wait(1s);
  EXPECT_TRUE(shows(host, "fan_stuck", {2}));
}

/// In the steady state the housing exceeds the ambient air by P·R; 2·R doubles that.
TEST(FanStuck, DoublesWhatTheHousingIsAboveTheAir) {
  ServoConfig servo = drive();
  servo.profile.drive.thermal.C_housing = servo.profile.drive.thermal.C_winding =
      0.1;  // J/K: 0.3 s
  Host host(servo);
  host.wait(100ms);
  host.ask("141#8C01000000000000");
  host.ask("141#A2000000407E0500");  // 3600 dps
  host.wait(4s);
  const auto above_air_K = [&host] { return host.bus.truth(1).temp_housing - 25; };
  const double healthy_K = above_air_K();
  test::inject(host, "fan_stuck", {2});
  host.wait(4s);
  EXPECT_GT(healthy_K, 1);
  // The copper resistance grows by 0.4 % per kelvin.
  EXPECT_NEAR(above_air_K() / healthy_K, 2, 0.004 * 2 * healthy_K);
}

}  // namespace plant_fault_evidence_test
}  // namespace lk::emulator
