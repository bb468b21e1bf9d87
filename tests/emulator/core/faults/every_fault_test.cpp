// Each kind of fault changes something in a run of three drives, and the bus reports it. Plant
// faults report effects exactly on the drives on which they are visible.

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "emulator/core/generation.hpp"
#include "tests/emulator/core/faults/fault_support.hpp"
#include "tests/support/serial_bus.hpp"

namespace lk::emulator {
namespace every_fault_test {

using namespace std::chrono_literals;
using test::frame;
using test::Host;

/// Drives on which a plant fault is visible: cold at rest, warm at rest, turning, without power. At
/// rest no current flows and the shaft does not turn. A controller without power reads no sensor.
enum Visible : unsigned { kNever = 0, kCold = 1, kWarm = 2, kRunning = 4, kUnpowered = 8 };
constexpr unsigned kPowered = kCold | kWarm | kRunning;
constexpr unsigned kAlways = kPowered | kUnpowered;

/// Values of the fault, the drive and the adapter that show it. Kinds without a row show an effect
/// with the defaults of their parameters on drive 1; plant faults only while it turns.
struct Situation {
  std::vector<FaultValue> values = {};
  unsigned visible = kRunning;
  int id = 1;
  std::string_view adapter = "none";
};
constexpr auto kOnBoot = static_cast<FaultChoice>(LostAfter::kBoot);
const std::map<std::string_view, Situation> kSituations = {
    {"delay", {{3}}},
    {"boot_garbage", {.id = 2}},
    {"adapter_latency", {{100, 100}}},
    {"adapter_overrun", {.values = {1}, .adapter = "ftdi_default"}},
    {"write_stalls", {{2, 20}}},
    {"late_release", {{300}}},
    {"forgets_broadcast", {.id = 3}},
    {"first_command_lost", {{kOnBoot}}},
    {"id_changed", {{12}}},
    {"encoder_jump", {{10}, kPowered}},
    {"encoder_noise", {{1}, kPowered}},
    {"encoder_drift", {{90}, kPowered}},
    {"encoder_garbage", {{}, kPowered}},
    {"encoder_lost_magnet", {{}, kPowered}},
    {"encoder_slow", {{10}, kRunning}},
    {"current_offset", {{1}, kPowered}},
    {"current_gain", {{0.5}, kRunning}},
    {"current_noise", {{0.5}, kPowered}},
    {"temperature_stuck", {{80}, kPowered}},
    {"temperature_off", {{10}, kPowered}},
    {"voltage_stuck", {{20}, kPowered}},
    {"voltage_off", {{-2}, kPowered}},
    {"friction", {{3}, kRunning}},
    {"inertia", {{3}, kRunning}},
    {"load_step", {{20}, kAlways}},  // friction and brake hold 10.5 Nm
    {"kick", {{0.1}, kAlways}},
    {"backlash", {{3}, kRunning}},
    {"end_stop", {{-5, 5}, kRunning}},
    {"brake_late", {{}, kNever, 2}},  // the coil is not switched
    {"fan_stuck", {{2}, kWarm | kRunning}},
    {"sag", {{15}, kPowered}},
    {"dip", {{}, kPowered}},
    {"cut", {{}, kPowered}},
    {"reboot_loop", {{}, kPowered}},
    {"no_regeneration", {{}, kNever}},  // no braking
    {"clock_drift", {{10}, kRunning}},
};

Situation situation_of(const FaultRow& row) {
  const auto found = kSituations.find(row.word);
  return found == kSituations.end() ? Situation{} : found->second;
}

Fault fault_with(const FaultRow& row, const std::vector<FaultValue>& values) {
  Fault fault = fault_of(row);
  std::ranges::copy(values, fault.values.begin());
  return fault;
}

/// A gear of 10 with play, and a load.
void add_gear(model::DriveParams& drive) {
  drive.mechanics.gear_ratio = 10;
  drive.mechanics.backlash_out = 0.02;
  drive.mechanics.gear_stiffness_out = 500;
  drive.mechanics.gear_damping_out = 0.5;
  drive.mechanics.J_out = 1e-3;
  drive.load.J = 0.02;
}

/// Geared drives with play and a load, warmer than the ambient air. The second has a brake, the
/// third answers only multi-drive commands.
BusConfig config(std::string_view adapter) {
  BusConfig config = test::powered_bus({1, 2, 3}, 1'000'000);
  for (ServoConfig& servo : config.servos) {
    add_gear(servo.profile.drive);
    servo.profile.drive.mechanics.tau_coulomb_out = 0.01;
    servo.rom.acceleration_dps_s = 50'000;
    servo.boot_temperature_C = 30;
  }
  config.servos[0].rom.protections[static_cast<std::size_t>(model::Error::kUnderVoltage)] = {
      true, 12, 0.5, 0};
  config.servos[1].profile.drive.brake.tau = 1;
  config.servos[1].quirks.dialect.brake_command = true;
  config.servos[2].rom.broadcast_mode = true;
  config.adapter = find_adapter(adapter);
  return config;
}

/// Values that a fault may change, collected during one step.
struct Observation {
  std::vector<TimedFrame> wire;
  std::vector<double> signals;
  std::vector<Registers> rom;
  bool operator==(const Observation&) const = default;
};

constexpr SimTime kStep = 5ms;
constexpr SimTime kFaultAt = 500ms;

/// A bus with constant queries. The first drive moves to and fro, gets new settings, restarts,
/// loses its supply voltage and is switched off.
class CanRun {
 public:
  static constexpr SimTime kDuration = 3s;
  CanRun(std::string_view adapter, const Fault* fault) : bus(config(adapter)) {
    if (fault != nullptr) bus.plan({kFaultAt, {kWholeBus, SetFault{*fault}}});
  }

  Observation step() {
    const SimTime at = bus.time();
    const auto send = [&](std::string_view text) { bus.receive({at, frame(text)}); };
    send("141#9C00000000000000");
    if (at % 20ms == 0ns) send("280#3200320000003200");
    if (at == 100ms || at == 2500ms) send("141#A200000040420F00");  // 10000 dps
    if (at == 1s) send("141#A2000000C0BDF0FF");                     // and back
    if (at == 1500ms) send("141#A200000000000000");  // a turning motor would supply the drive
    if (at == 200ms || at == 700ms)
      send(at < 500ms ? "141#3200646432323232"  // gains
                      : "141#3200656532323232");
    if (at == 2600ms) send("141#3300000000000000");  // acceleration
    if (at == 1800ms) bus.apply({1, PowerCycle{100ms}});
    if (at == 600ms) send("142#8C01000000000000");  // release the brake
    if (at == 600ms) send("142#A2000000C0D40100");  // 1200 dps
    if (at == 1s) send("142#8C00000000000000");
    if (at == 1800ms) bus.apply({2, PowerCycle{100ms}});
    if (at == 1800ms) bus.apply({3, PowerCycle{100ms}});
    if (at == 2600ms) bus.apply({1, Sag{10, 300ms}});
    if (at == 2950ms) send("141#9B00000000000000");
    if (at == 2980ms) send("141#8000000000000000");
    bus.advance_to(at + kStep);
    Observation seen;
    for (const int id : {1, 2, 3}) {
      for (const Signal& signal : signals()) seen.signals.push_back(signal.read(bus.view(id)));
    }
    bus.take_replies(seen.wire);
    std::vector<RomWrite> writes;
    bus.take_rom_writes(writes);
    for (const RomWrite& write : writes) seen.rom.push_back(write.rom);
    seen.rom.push_back(bus.servo(1).rom);
    return seen;
  }

  Bus bus;
};

/// As CanRun, on RS-485: one drive with a gain of 13, queried for gains and state.
class SerialRun {
 public:
  static constexpr SimTime kDuration = 1s;
  explicit SerialRun(const Fault* fault) : bus(config()) {
    if (fault != nullptr) bus.plan({kFaultAt, {kWholeBus, SetFault{*fault}}});
  }

  Observation step() {
    const SimTime at = bus.time();
    bus.receive({at, test::packet(at % 10ms == 0ns ? "3E 30 01 00 6F" : "3E 9C 01 00 DB")});
    bus.advance_to(at + kStep);
    Observation seen;
    bus.take_replies(seen.wire);
    return seen;
  }

  Bus bus;

 private:
  static BusConfig config() {
    ServoConfig servo = test::serial_drive(Generation::kLegacy);
    servo.rom.gains.angle_kp = 13;
    return test::serial_bus({servo});
  }
};

/// Runs both until the fault has changed something and the bus has reported it.
template <class Run>
void expect_change_and_report(Run healthy, Run faulty) {
  std::optional<SimTime> changed_at;
  const auto evidence = [&] {
    const std::vector<FaultReport> faults = faulty.bus.faults();
    return faults.size() == 1 ? faults[0].evidence : FaultEvidence{};
  };
  while (faulty.bus.time() < Run::kDuration && !(changed_at && evidence().effects > 0)) {
    const bool equal = healthy.step() == faulty.step();
    if (!equal && !changed_at) changed_at = faulty.bus.time();
  }
  ASSERT_TRUE(changed_at) << "no change";
  EXPECT_GE(*changed_at, kFaultAt);
  ASSERT_EQ(faulty.bus.faults().size(), 1U);
  EXPECT_GT(evidence().effects, 0U);
  ASSERT_TRUE(evidence().first_effect_at);
  EXPECT_GE(*evidence().first_effect_at, kFaultAt);
  EXPECT_NE(evidence().first_on, "");
}

class EveryFault : public testing::TestWithParam<std::string_view> {};

TEST_P(EveryFault, ChangesARunAndIsReported) {
  const FaultRow& row = *find_fault(GetParam());
  const Situation situation = situation_of(row);
  Fault fault = fault_with(row, situation.values);
  if (!row.of_bus) fault.ids = {situation.id};
  if (row.of_bus) fault.probability = 0.5;  // with 1, the bus would be silent
  if (row.serial) {
    expect_change_and_report(SerialRun(nullptr), SerialRun(&fault));
  } else {
    expect_change_and_report(CanRun(situation.adapter, nullptr), CanRun(situation.adapter, &fault));
  }
}

bool is_any(const FaultRow&) { return true; }
bool is_of_plant(const FaultRow& row) {
  return row.plant != nullptr ||
         (row.group >= FaultGroup::kSensors && row.group <= FaultGroup::kPower);
}
std::vector<std::string_view> words(bool (*selects)(const FaultRow&)) {
  std::vector<std::string_view> words;
  for (const FaultRow& row : fault_table()) {
    if (selects(row)) words.push_back(row.word);
  }
  return words;
}
constexpr auto kWordAsName = [](const auto& word) { return std::string(word.param); };
INSTANTIATE_TEST_SUITE_P(Faults, EveryFault, testing::ValuesIn(words(is_any)), kWordAsName);

/// A fault acts where its function is called; without a function it would never take effect.
TEST(FaultTable, EachRowHasAFunctionTextsAndAUniqueWord) {
  for (const FaultRow& row : fault_table()) {
    EXPECT_EQ(row.adapter == nullptr, row.adapter_shows == nullptr) << row.word;
    EXPECT_TRUE(row.plant != nullptr || row.adapter != nullptr || row.on_query != nullptr ||
                row.on_reply != nullptr || row.destroys != nullptr || row.babble != nullptr ||
                row.duplicate != nullptr || row.on_read != nullptr || row.echoes ||
                row.line_hold_time != nullptr || row.cut != nullptr || row.firmware != nullptr ||
                row.at_once != nullptr)
        << row.word;
    EXPECT_FALSE(row.about.en.empty() || row.about.zh.empty()) << row.word;
    EXPECT_EQ(find_fault(row.word), &row) << "duplicate word";
  }
  for (const auto& [word, situation] : kSituations) EXPECT_NE(find_fault(word), nullptr) << word;
}

// --- plant faults

/// Geared with play, friction and a brake; at rest.
ServoConfig drive(double temperature_C = 25) {
  ServoConfig servo = test::powered_drive();
  model::DriveParams& d = servo.profile.drive;
  add_gear(d);
  d.mechanics.tau_coulomb = d.mechanics.tau_static = 0.05;
  d.brake.tau = 1;
  servo.quirks.dialect.brake_command = true;
  servo.rom.acceleration_dps_s = 2000;
  servo.boot_temperature_C = temperature_C;
  return servo;
}

/// Returns whether the fault has taken effect half a second after its start.
bool is_visible(Host host, const FaultRow& row, const std::vector<FaultValue>& values) {
  Fault fault = fault_with(row, values);
  fault.ids = {1};
  host.bus.apply({kWholeBus, SetFault{fault}});
  host.wait(500ms);
  return test::evidence(host).effects > 0;
}

Host booted(const ServoConfig& servo) {
  Host host(servo);
  host.wait(100ms);
  return host;
}

Host running(const ServoConfig& servo) {
  Host host = booted(servo);
  host.ask("141#8C01000000000000");
  host.ask("141#A2000000407E0500");  // 3600 dps
  return host;
}

Host unpowered(const ServoConfig& servo) {
  Host host = booted(servo);
  host.bus.apply({1, PowerOff{}});
  host.wait(1s);
  EXPECT_FALSE(host.bus.telemetry(1).alive);
  return host;
}

class PlantFault : public testing::TestWithParam<std::string_view> {};

TEST_P(PlantFault, HasEvidenceExactlyWhereItIsVisible) {
  const FaultRow& row = *find_fault(GetParam());
  const Situation situation = situation_of(row);
  const auto expect_visible = [&](const Host& host, Visible drive, const char* name) {
    EXPECT_EQ(is_visible(host, row, situation.values), (situation.visible & drive) != 0) << name;
  };
  Host cold = booted(drive());
  cold.ask("141#8000000000000000");
  expect_visible(cold, kCold, "cold");
  Host warm = booted(drive(60));
  warm.ask("141#8000000000000000");
  expect_visible(warm, kWarm, "warm");
  Host accelerating = running(drive());
  accelerating.wait(2s);
  accelerating.ask("141#A200000080FC0A00");  // 7200 dps, in 1.8 s
  expect_visible(accelerating, kRunning, "running");
  expect_visible(unpowered(drive()), kUnpowered, "unpowered");
}

INSTANTIATE_TEST_SUITE_P(Faults, PlantFault, testing::ValuesIn(words(is_of_plant)), kWordAsName);

/// A hot motor also cools without power.
TEST(FanStuck, IsVisibleOnAWarmDriveWithoutPower) {
  EXPECT_TRUE(is_visible(unpowered(drive(60)), *find_fault("fan_stuck"), {2}));
}

/// In the steady state the housing exceeds the ambient air by P·R; 2·R doubles that.
TEST(FanStuck, DoublesTheTemperatureRiseOfTheHousing) {
  ServoConfig servo = drive();
  servo.profile.drive.thermal.C_housing = servo.profile.drive.thermal.C_winding =
      0.1;  // J/K: 0.3 s
  Host host = running(servo);
  host.wait(4s);
  const auto temperature_rise_K = [&host] { return host.bus.truth(1).temp_housing - 25; };
  const double healthy_K = temperature_rise_K();
  test::inject(host, "fan_stuck", {2});
  host.wait(4s);
  EXPECT_GT(healthy_K, 1);
  // The copper resistance grows by 0.4 % per kelvin.
  EXPECT_NEAR(temperature_rise_K() / healthy_K, 2, 0.004 * 2 * healthy_K);
}

}  // namespace every_fault_test
}  // namespace lk::emulator
