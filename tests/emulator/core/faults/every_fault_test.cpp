// Each kind of fault changes something in a run of three drives, and the bus reports it.

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "emulator/core/generation.hpp"
#include "tests/support/faults.hpp"
#include "tests/support/serial_bus.hpp"
#include "tests/support/test_bus.hpp"

namespace lk::emulator {
namespace every_fault_test {

using namespace std::chrono_literals;
using test::frame;

/// Values of the fault, by default on drive 1. Kinds that are missing here have no situation that
/// shows an effect.
struct Situation {
  std::vector<FaultValue> values = {};
  int id = 1;
  std::string_view adapter = "none";
};
constexpr auto kOnBoot = static_cast<FaultChoice>(LostAfter::kBoot);
const std::map<std::string_view, Situation> kSituations = {
    {"drop", {}},
    {"delay", {{3}}},
    {"duplicate", {}},
    {"corrupt", {}},
    {"stale", {}},
    {"torn_reply", {}},
    {"reorder", {}},
    {"wrong_dlc", {}},
    {"wrong_id", {}},
    {"duplicate_id", {}},
    {"silent", {}},
    {"babbling", {}},
    {"error_frames", {}},
    {"bus_off", {}},
    {"boot_garbage", {{}, 2}},
    {"wrong_bitrate", {}},
    {"no_termination", {}},
    {"queue_full", {}},
    {"adapter_latency", {{100, 100}}},
    {"adapter_batch", {}},
    {"adapter_overrun", {{1}, 1, "ftdi_default"}},
    {"write_stalls", {{2, 20}}},
    {"checksum_bad", {}},
    {"byte_lost", {}},
    {"byte_gap", {}},
    {"echo", {}},
    {"cr_to_lf", {}},
    {"late_release", {{300}}},
    {"encoder_stuck", {}},
    {"encoder_jump", {{10}}},
    {"encoder_noise", {{1}}},
    {"encoder_drift", {{90}}},
    {"encoder_garbage", {}},
    {"encoder_lost_magnet", {}},
    {"encoder_slow", {{10}}},
    {"current_offset", {{1}}},
    {"current_gain", {{0.5}}},
    {"current_noise", {{0.5}}},
    {"current_stuck", {}},
    {"temperature_stuck", {{60}}},
    {"temperature_off", {{10}}},
    {"voltage_stuck", {{20}}},
    {"voltage_off", {{-2}}},
    {"phase_open", {}},
    {"switch_open", {}},
    {"switch_shorted", {}},
    {"bridge_dead", {}},
    {"calibration_lost", {}},
    {"jam", {}},
    {"friction", {{3}}},
    {"inertia", {{3}}},
    {"load_step", {{0.1}}},
    {"kick", {{0.01}}},
    {"backlash", {{3}}},
    {"coupling_broken", {}},
    {"end_stop", {{-5, 5}}},
    {"brake_late", {{}, 2}},
    {"fan_stuck", {{10}}},
    {"sag", {{15}}},
    {"dip", {}},
    {"cut", {}},
    {"reboot_loop", {}},
    {"no_regeneration", {}},
    {"reset", {}},
    {"hang", {}},
    {"slow_replies", {}},
    {"clock_drift", {{10}}},
    {"rom_write_fails", {}},
    {"rom_worn", {}},
    {"rom_damaged", {}},
    {"ram_flipped", {}},
    {"forgets_broadcast", {{}, 3}},
    {"forgets_limits", {}},
    {"clear_reply_before", {}},
    {"first_command_lost", {{kOnBoot}}},
    {"bus_held_after_off", {}},
    {"encoder_wrap_at_boot", {}},
    {"multi_turn_zero_at_boot", {}},
    {"id_changed", {{12}}},
};

/// Geared drives with play and a load, warmer than the ambient air. The second has a brake, the
/// third answers only multi-drive commands.
BusConfig config(std::string_view adapter) {
  BusConfig config = test::powered_bus({1, 2, 3}, 1'000'000);
  for (ServoConfig& servo : config.servos) {
    model::MechanicsParams& mechanics = servo.profile.drive.mechanics;
    mechanics.gear_ratio = 10;
    mechanics.backlash_out = 0.02;
    mechanics.gear_stiffness_out = 500;
    mechanics.gear_damping_out = 0.5;
    mechanics.J_out = 1e-3;
    mechanics.tau_coulomb_out = 0.01;
    servo.profile.drive.load.J = 0.02;
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
  ASSERT_TRUE(changed_at) << "it changes nothing";
  EXPECT_GE(*changed_at, kFaultAt);
  ASSERT_EQ(faulty.bus.faults().size(), 1U);
  EXPECT_GT(evidence().effects, 0U);
  ASSERT_TRUE(evidence().first_effect_at);
  EXPECT_GE(*evidence().first_effect_at, kFaultAt);
  EXPECT_NE(evidence().first_on, "");
}

class EveryFault : public testing::TestWithParam<std::string_view> {};

TEST_P(EveryFault, ChangesSomethingAndSaysSo) {
  const FaultRow& row = *find_fault(GetParam());
  const auto found = kSituations.find(row.word);
  ASSERT_NE(found, kSituations.end()) << "no situation that shows it";
  const Situation& situation = found->second;
  Fault fault = fault_of(row);
  std::ranges::copy(situation.values, fault.values.begin());
  if (!row.of_bus) fault.ids = {situation.id};
  if (row.of_bus) fault.probability = 0.5;  // with 1, the bus would be silent
  if (row.serial) {
    expect_change_and_report(SerialRun(nullptr), SerialRun(&fault));
  } else {
    expect_change_and_report(CanRun(situation.adapter, nullptr), CanRun(situation.adapter, &fault));
  }
}

std::vector<std::string_view> words() {
  std::vector<std::string_view> words;
  for (const FaultRow& row : fault_table()) words.push_back(row.word);
  return words;
}
INSTANTIATE_TEST_SUITE_P(Faults, EveryFault, testing::ValuesIn(words()),
                         [](const auto& word) { return std::string(word.param); });

TEST(FaultTable, NamesOnlyKnownSituations) { EXPECT_EQ(kSituations.size(), fault_table().size()); }

/// A fault acts where its function is called; without a function it would never take effect.
TEST(FaultTable, EachActsSomewhere) {
  for (const FaultRow& row : fault_table()) {
    EXPECT_EQ(row.adapter == nullptr, row.adapter_shows == nullptr) << row.word;
    EXPECT_TRUE(row.plant != nullptr || row.adapter != nullptr || row.on_query != nullptr ||
                row.on_reply != nullptr || row.destroys != nullptr || row.babble != nullptr ||
                row.duplicate != nullptr || row.on_read != nullptr || row.echoes ||
                row.line_hold_time != nullptr || row.firmware != nullptr || row.at_once != nullptr)
        << row.word;
    EXPECT_FALSE(row.about.en.empty() || row.about.zh.empty()) << row.word;
    EXPECT_EQ(find_fault(row.word), &row) << "two of this word";
  }
}

}  // namespace every_fault_test
}  // namespace lk::emulator
