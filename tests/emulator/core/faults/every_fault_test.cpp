// Every kind of the table, in the life of three drives that shows them all: something is otherwise
// than without the fault, and the bus says so.

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
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

/// What the kind is set to, on the drive 1 unless another is said. A kind that is not in here has
/// no situation that shows it.
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

/// Geared drives with play and a load; the second has a brake, the third answers commands for
/// several only.
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
  }
  config.servos[0].rom.protections[static_cast<std::size_t>(model::Error::kUnderVoltage)] = {
      true, 12, 0.5, 0};
  config.servos[1].profile.drive.brake.tau = 1;
  config.servos[1].quirks.dialect.brake_command = true;
  config.servos[2].rom.broadcast_mode = true;
  config.adapter = find_adapter(adapter);
  return config;
}

struct Life {
  std::vector<TimedFrame> wire;
  std::vector<double> signals;
  std::vector<Registers> rom;
  std::vector<FaultReport> faults;
};

/// They are asked all the time; the first turns to and fro, is written to, is started anew, loses
/// its voltage and is switched off.
Life live(const Fault* fault, std::string_view adapter) {
  Bus bus(config(adapter));
  if (fault != nullptr) bus.plan({500ms, {kWholeBus, SetFault{*fault}}});
  Life life;
  std::vector<RomWrite> writes;
  for (SimTime at{0}; at < 3s; at += 5ms) {
    const auto send = [&](std::string_view text) { bus.receive({at, frame(text)}); };
    send("141#9C00000000000000");
    if (at % 20ms == 0ns) send("280#3200320000003200");
    if (at == 100ms || at == 2500ms) send("141#A200000040420F00");  // 10000 dps
    if (at == 1s) send("141#A2000000C0BDF0FF");                     // and back
    if (at == 1500ms) send("141#A200000000000000");  // or its motor feeds it without a supply
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
    bus.advance_to(at + 5ms);
    for (const int id : {1, 2, 3}) {
      for (const Signal& signal : signals()) life.signals.push_back(signal.read(bus.view(id)));
    }
  }
  bus.take_replies(life.wire);
  bus.take_rom_writes(writes);
  for (const RomWrite& write : writes) life.rom.push_back(write.rom);
  life.rom.push_back(bus.servo(1).rom());
  life.faults = bus.faults();
  return life;
}

/// The same on RS-485, of one drive with a gain of 13 that is asked for its gains and its state.
Life live_serial(const Fault* fault) {
  ServoConfig servo = test::serial_drive(Generation::kLegacy);
  servo.rom.gains.angle_kp = 13;
  Bus bus(test::serial_bus({servo}));
  if (fault != nullptr) bus.plan({500ms, {kWholeBus, SetFault{*fault}}});
  for (SimTime at{0}; at < 1s; at += 5ms) {
    bus.receive({at, test::packet(at % 10ms == 0ns ? "3E 30 01 00 6F" : "3E 9C 01 00 DB")});
    bus.advance_to(at + 5ms);
  }
  Life life;
  bus.take_replies(life.wire);
  life.faults = bus.faults();
  return life;
}

TEST(EveryFault, ChangesSomethingAndSaysSo) {
  std::map<std::string_view, Life> healthy;
  EXPECT_EQ(kSituations.size(), fault_table().size());
  for (const FaultRow& row : fault_table()) {
    SCOPED_TRACE(row.word);
    const auto found = kSituations.find(row.word);
    if (found == kSituations.end()) {
      ADD_FAILURE() << "no situation that shows it";
      continue;
    }
    const Situation& situation = found->second;
    Fault fault = fault_of(row);
    std::ranges::copy(situation.values, fault.values.begin());
    if (!row.of_bus) fault.ids = {situation.id};
    if (row.of_bus) fault.probability = 0.5;  // or nobody is left to say anything
    const std::string_view where = row.serial ? "RS-485" : situation.adapter;
    if (!healthy.contains(where)) {
      healthy[where] = row.serial ? live_serial(nullptr) : live(nullptr, where);
    }
    const Life& sound = healthy[where];
    const Life faulty = row.serial ? live_serial(&fault) : live(&fault, where);
    EXPECT_TRUE(faulty.wire != sound.wire || faulty.signals != sound.signals ||
                faulty.rom != sound.rom);
    ASSERT_EQ(faulty.faults.size(), 1U);
    const FaultEvidence& evidence = faulty.faults[0].evidence;
    EXPECT_GT(evidence.effects, 0U);
    ASSERT_TRUE(evidence.first_effect_at);
    EXPECT_GE(*evidence.first_effect_at, 500ms);
    EXPECT_NE(evidence.first_on, "");
  }
}

/// A function stands where a fault acts; one that acts nowhere would never take effect.
TEST(EveryFault, ActsSomewhere) {
  for (const FaultRow& row : fault_table()) {
    EXPECT_EQ(row.adapter == nullptr, row.adapter_shows == nullptr) << row.word;
    EXPECT_TRUE(row.plant != nullptr || row.adapter != nullptr || row.hear != nullptr ||
                row.say != nullptr || row.destroys != nullptr || row.babble != nullptr ||
                row.duplicate != nullptr || row.read != nullptr || row.echoes ||
                row.keeps_line != nullptr || row.firmware != nullptr || row.at_once != nullptr)
        << row.word;
    EXPECT_FALSE(row.about.en.empty() || row.about.zh.empty()) << row.word;
    EXPECT_EQ(find_fault(row.word), &row) << "two of this word";
  }
}

}  // namespace every_fault_test
}  // namespace lk::emulator
