// Supply and ROM of a drive: boot, brown-outs, timing of writes, interruptions.

#include <gtest/gtest.h>

#include "tests/emulator/core/core_support.hpp"
#include "tests/emulator/core/faults/fault_support.hpp"

namespace lk::emulator {
namespace power_test {

using namespace std::chrono_literals;
using test::frame;
using test::Host;
using test::powered_bus;
using test::powered_drive;
using test::replies_of;
using test::rom_writes_of;
using test::send;
using test::supply;

TEST(Power, DriveRunsUntilTheLinkIsEmptyAndBootsWhenSwitchedOn) {
  Host host(powered_bus({1, 2}));
  host.bus.apply({1, PowerOff{}});
  EXPECT_TRUE(answers(host));  // the link still supplies it
  host.wait(400ms);            // C·24 V/0.04 A·ln(24/5) = 442 ms
  EXPECT_TRUE(answers(host));
  host.wait(80ms);
  EXPECT_FALSE(answers(host));
  EXPECT_TRUE(answers(host, 2));
  EXPECT_EQ(host.bus.stats().count(Drop::kNoPower), 1U);

  host.bus.apply({1, PowerOn{}});
  host.wait(45ms);
  EXPECT_FALSE(answers(host));  // booting
  host.wait(10ms);
  EXPECT_TRUE(answers(host));
}

TEST(Power, CycleClearsRamTurnsErrorsAndMotionAndKeepsRom) {
  Host host(powered_drive());
  host.ask("141#3400000068010000");        // acceleration 360 dps/s, RAM
  host.ask("141#32000A0B0C0D0E0F");        // gains, ROM
  send(host, "141#A4006801A08C0000", 2s);  // to 360.00 degrees at 360 dps
  EXPECT_NEAR(static_cast<double>(host.multi_turn_cdeg()), 36000.0, 300.0);

  host.bus.apply({1, PowerCycle{}});
  host.wait(1s);
  EXPECT_EQ(host.ask("141#3300000000000000"), frame("141#3300000000000000"));
  EXPECT_EQ(host.ask("141#3000000000000000"), frame("141#30000A0B0C0D0E0F"));
  EXPECT_NEAR(static_cast<double>(host.multi_turn_cdeg()), 0.0, 300.0);
  EXPECT_EQ(host.run_state(), RunState::kRunning);
  EXPECT_EQ(host.bus.truth(1).i_q_ref, 0.0);  // idle
}

TEST(Power, ShaftTurnedWhileOffIsReadAtBoot) {
  Host host(powered_drive());
  ASSERT_EQ(host.single_turn_cdeg(), 4500);
  host.bus.apply({1, PowerOff{}});
  host.wait(600ms);
  host.bus.apply({1, TurnShaft{200.0}});
  host.bus.apply({1, PowerOn{}});
  host.wait(60ms);
  EXPECT_NEAR(host.single_turn_cdeg(), 24500, 3);
  EXPECT_NEAR(static_cast<double>(host.multi_turn_cdeg()), 24500.0 - 36000.0, 3.0);
}

TEST(Power, OnlyAResetEndsAMove) {
  Host host(powered_drive());
  send(host, "141#A200000050460000", 300ms);  // 180 dps
  supply(host, 9, 50ms);
  supply(host, 24, 200ms);
  EXPECT_NEAR(host.state_2().speed_dps, 180.0, 5.0);

  supply(host, 3, 20ms);
  EXPECT_FALSE(answers(host));
  supply(host, 24, 60ms);
  EXPECT_TRUE(answers(host));
  EXPECT_EQ(host.bus.truth(1).omega_ref, 0.0);
  EXPECT_EQ(host.bus.truth(1).i_q_ref, 0.0);
}

TEST(Power, RampIsEven) {
  Host host(powered_drive());
  host.bus.apply({1, SupplyVoltage{14.0, 100ms}});
  host.wait(50ms);
  EXPECT_NEAR(host.bus.truth(1).v_bus, 19.0, 0.15);  // a step of the ramp is 0.1 V
  host.wait(51ms);                                   // plus time for the link
  EXPECT_NEAR(host.bus.truth(1).v_bus, 14.0, 0.05);
  host.bus.apply({1, SupplyVoltage{24.0, 100ms}});
  host.wait(50ms);
  supply(host, 12, 100ms);  // replaces the ramp
  EXPECT_NEAR(host.bus.truth(1).v_bus, 12.0, 0.05);
}

TEST(Power, SagEndsAtThePreviousOrRampedVoltage) {
  Host host(powered_drive());
  const auto link_V = [&](SimTime wait) {
    host.wait(wait);
    return host.bus.truth(1).v_bus;
  };
  host.bus.apply({1, SupplyVoltage{18.0}});
  host.bus.apply({1, Sag{10.0, 50ms}});
  EXPECT_NEAR(link_V(49ms), 10.0, 0.05);
  EXPECT_NEAR(link_V(20ms), 18.0, 0.05);  // not the 24 V of the start

  host.bus.apply({1, SupplyVoltage{22.0, 100ms}});
  host.wait(20ms);
  host.bus.apply({1, Sag{12.0, 30ms}});
  EXPECT_NEAR(link_V(29ms), 12.0, 0.05);
  EXPECT_NEAR(link_V(20ms), 22.0, 0.05);

  host.bus.apply({1, Sag{12.0, 50ms}});
  host.wait(10ms);
  host.bus.apply({1, Sag{9.0, 50ms}});
  EXPECT_NEAR(link_V(49ms), 9.0, 0.05);
  EXPECT_NEAR(link_V(20ms), 22.0, 0.05);

  host.bus.apply({1, Sag{12.0, 50ms}});
  host.bus.apply({1, SupplyVoltage{16.0, 10ms}});
  EXPECT_NEAR(link_V(100ms), 16.0, 0.05);  // the last command counts
  EXPECT_FALSE(host.bus.next_due());
}

TEST(Power, ConfiguredEventsHappenAtTheirTimes) {
  BusConfig config = powered_bus({1, 2});
  config.events = {{0ms, {2, PowerOff{}}},
                   {100ms, {1, SupplyVoltage{3.0, 0ns}}},
                   {150ms, {1, SupplyVoltage{24.0, 0ns}}},
                   {300ms, {2, PowerOn{}}}};
  Host host(config);
  EXPECT_TRUE(answers(host));
  EXPECT_FALSE(answers(host, 2));  // never switched on
  host.wait(120ms);
  EXPECT_FALSE(answers(host));
  host.wait(100ms);
  EXPECT_TRUE(answers(host));
  EXPECT_FALSE(answers(host, 2));
  host.wait(140ms);
  EXPECT_TRUE(answers(host, 2));
}

TEST(Power, MultiDriveFrameIsDroppedWhenAllDrivesAreOff) {
  BusConfig config = powered_bus({1, 2});
  config.servos[0].rom.broadcast_mode = true;
  Host host(config);
  supply(host, 0, 50ms);
  EXPECT_TRUE(host.talk(frame("280#0000000000000000")).empty());
  EXPECT_EQ(host.bus.stats().count(Drop::kWrongMode), 1U);  // drive 2 has power
  host.bus.apply({2, SupplyVoltage{0.0, 0ns}});
  host.wait(50ms);
  EXPECT_TRUE(host.talk(frame("280#0000000000000000")).empty());
  EXPECT_EQ(host.bus.stats().count(Drop::kNoPower), 1U);
}

TEST(Power, PendingReplyIsLostWithThePower) {
  BusConfig config = powered_bus({1}, 1'000'000);
  config.servos[0].reply_time = 100ms;
  Host host(config);
  host.bus.receive({0ns, frame("141#9C00000000000000")});
  host.wait(10ms);
  supply(host, 0, 1s);
  EXPECT_EQ(host.bus.stats().replies, 0U);
  EXPECT_EQ(host.bus.stats().replies_lost, 1U);
}

TEST(Power, RestartWithoutPowerHasNoEffect) {
  Host host(powered_drive());
  host.ask("141#3400000068010000");  // acceleration, RAM
  supply(host, 0, 50ms);
  const Registers ram = host.bus.servo(1).ram;
  host.bus.power_cycle(1);
  EXPECT_FALSE(answers(host));
  EXPECT_EQ(host.bus.servo(1).ram, ram);  // kept until it restarts
}

TEST(Power, UnfinishedFrameOccupiesTheWire) {
  BusConfig config = powered_bus({1, 2}, 10'000);  // a frame takes 12 ms
  config.servos[0].reply_time = 0ns;
  config.servos[1].reply_time = 0ns;
  Host host(config);
  host.bus.receive({0ns, frame("141#9A00000000000000")});
  host.wait(12ms + 300us);  // the reply is on the wire
  supply(host, 0, 0ns);
  host.bus.receive({13ms, frame("142#9A00000000000000")});
  host.wait(27ms);
  EXPECT_TRUE(replies_of(host.bus).empty());
  EXPECT_EQ(host.bus.stats().replies_lost, 1U);
  host.wait(12ms);
  const auto replies = replies_of(host.bus);
  ASSERT_EQ(replies.size(), 1U);  // after the query, the spoiled frame and the other query
  EXPECT_GT(replies[0].at, 4 * 11ms);
}

const protocol::Frame kWriteGains = frame("141#32000A0B0C0D0E0F");  // to ROM

/// The drive's other replies wait as well; another drive's do not.
TEST(Memory, ReplyToAWriteWaitsForTheFlash) {
  BusConfig config = powered_bus({1, 2});
  config.servos[0].flash.write_time = 5ms;
  Host host(config);
  for (const protocol::Frame& query :
       {kWriteGains, frame("141#9A00000000000000"), frame("142#9A00000000000000")}) {
    host.bus.receive({0ns, query});
  }
  auto replies = test::run_until(host.bus, 4999us);
  ASSERT_EQ(replies.size(), 1U);
  EXPECT_EQ(replies[0].frame.id, 0x142U);
  EXPECT_TRUE(rom_writes_of(host.bus).empty());
  replies = test::run_until(host.bus, 5ms);
  ASSERT_EQ(replies.size(), 2U);
  EXPECT_EQ(replies[0], (TimedFrame{5ms, kWriteGains, 1}));
  EXPECT_EQ(replies[1].frame.data[0], 0x9A);  // a drive replies in order
  EXPECT_EQ(replies[1].after_rom_write, 0U);
  const auto writes = rom_writes_of(host.bus);
  ASSERT_EQ(writes.size(), 1U);
  EXPECT_EQ(writes[0].number, 1U);
  EXPECT_EQ(writes[0].rom.gains.speed_kp, 0x0C);
  EXPECT_EQ(writes[0].wear[0], 1U);
}

/// A restart of the controller loses the pending reply as well.
TEST(Memory, PowerLossAndRestartDiscardUnfinishedWrites) {
  for (const bool restart : {false, true}) {
    ServoConfig config = powered_drive();
    config.flash.write_time = 20ms;
    Host host(config);
    host.bus.receive({0ns, kWriteGains});
    if (!restart) host.bus.receive({0ns, frame("141#3200010203040506")});
    host.wait(10ms);
    if (restart) {
      host.bus.power_cycle(1);
      EXPECT_FALSE(host.bus.next_due());
      EXPECT_EQ(host.bus.stats().replies_lost, 1U);
    } else {
      supply(host, 0, 100ms);
      supply(host, 24, 100ms);
    }
    EXPECT_TRUE(rom_writes_of(host.bus).empty());
    EXPECT_EQ(host.ask("141#3000000000000000"), frame("141#3000646432283232"));  // factory
    EXPECT_EQ(host.bus.servo(1).wear[0], 0U);
  }
}

TEST(Memory, WornCellsKeepTheirContent) {
  ServoConfig config = powered_drive();
  config.flash = {.write_time = 0ns, .endurance = 2};
  Host host(config);
  send(host, {"141#3200010101010101", "141#3200020202020202"});
  EXPECT_EQ(host.ask("141#3200030303030303"), frame("141#3200030303030303"));
  EXPECT_EQ(host.ask("141#3000000000000000"), frame("141#3000030303030303"));  // RAM
  host.ask("141#91000000000000FF");  // another parameter has its own cells
  host.bus.apply({1, PowerCycle{}});
  host.wait(1s);
  EXPECT_EQ(host.ask("141#3000000000000000"), frame("141#3000020202020202"));
  EXPECT_EQ(host.bus.servo(1).wear[0], 2U);
}

/// A host that writes ROM 15 times as fast as the flash: 5 s of that on two drives.
TEST(Memory, WritesFasterThanTheFlashAreDropped) {
  for (const std::int64_t bitrate : {std::int64_t{0}, std::int64_t{1'000'000}}) {
    BusConfig config = powered_bus({1, 2}, bitrate);
    config.servos[0].flash.write_time = 2ms;
    Host host(config);
    std::uint64_t busy_before = 0;
    for (int n = 0; n < 37'500; ++n) {
      const SimTime at = n * 133us;
      host.bus.advance_to(at);
      host.bus.receive({at, kWriteGains});
      if (n % 7500 == 0) {
        const BusStats stats = host.bus.stats();
        EXPECT_TRUE(n == 0 || stats.count(Drop::kDriveBusy) > busy_before + 6000);
        busy_before = stats.count(Drop::kDriveBusy);
      }
    }
    host.wait(2ms * CanWire::kDriveQueue + 1ms);  // the queue holds no more
    EXPECT_FALSE(host.bus.next_due());
    const BusStats stats = host.bus.stats();
    EXPECT_EQ(stats.frames, stats.queries + stats.count(Drop::kDriveBusy));
    EXPECT_EQ(stats.replies, stats.queries);
    EXPECT_EQ(stats.rom_writes, stats.queries);  // unanswered writes are not executed
    EXPECT_NEAR(static_cast<double>(stats.queries), 5.0 / 2e-3, 30.0);
    EXPECT_EQ(rom_writes_of(host.bus).size(), stats.queries);
    replies_of(host.bus);
    EXPECT_EQ(host.talk(frame("142#9C00000000000000"), 1ms).size(), 1U);
  }
}

TEST(Memory, SettingActsAtOnceAndIsKeptOnceTheFlashIsDone) {
  ServoConfig config = powered_drive();
  config.flash = {.write_time = 5ms, .endurance = 2};
  Host host(config);
  Registers wanted = config.rom;
  wanted.max_speed_dps = 90;
  wanted.broadcast_mode = true;  // another setting
  ASSERT_TRUE(host.bus.write_setting(1, RomParameter::kMaxSpeed, wanted));
  EXPECT_EQ(host.bus.servo(1).ram.max_speed_dps, 90);
  send(host, "141#A3000000A08C0000", 4ms);  // to 360.00 degrees
  EXPECT_TRUE(rom_writes_of(host.bus).empty());
  host.wait(1ms);
  const auto writes = rom_writes_of(host.bus);
  ASSERT_EQ(writes.size(), 1U);
  EXPECT_EQ(writes[0].number, 1U);
  EXPECT_EQ(writes[0].rom.max_speed_dps, 90);
  EXPECT_FALSE(writes[0].rom.broadcast_mode);
  EXPECT_EQ(writes[0].wear[static_cast<std::size_t>(RomParameter::kMaxSpeed)], 1U);
  host.wait(500ms);
  EXPECT_NEAR(host.state_2().speed_dps, 90.0, test::kSpeedStep_dps);

  wanted.max_speed_dps = 50;
  ASSERT_TRUE(host.bus.write_setting(1, RomParameter::kMaxSpeed, wanted));
  host.bus.power_cycle(1);  // before the flash has finished
  EXPECT_EQ(host.bus.servo(1).ram.max_speed_dps, 90);
  for (const double speed_dps : {60.0, 70.0}) {
    wanted.max_speed_dps = speed_dps;
    ASSERT_TRUE(host.bus.write_setting(1, RomParameter::kMaxSpeed, wanted));
    host.wait(5ms);
  }
  host.bus.power_cycle(1);
  EXPECT_EQ(host.bus.servo(1).ram.max_speed_dps, 60) << "worn";
}

TEST(Memory, EverySettingCanBeWritten) {
  Host host(powered_drive());
  Registers wanted = host.bus.servo(1).rom;
  wanted.gains.speed_kp = 77;
  wanted.acceleration_dps_s = 360;
  wanted.encoder_offset = 1024;
  wanted.max_torque_current_lsb = 500;
  wanted.max_power_permille = 400;
  wanted.max_speed_dps = 720;
  wanted.max_angle_deg = 180;
  wanted.current_ramp_A_s = 10;
  wanted.protections[0] = {true, 18.0, 1.0, 0.01};
  for (std::size_t p = 0; p < kRomParameters; ++p) {
    EXPECT_TRUE(host.bus.write_setting(1, static_cast<RomParameter>(p), wanted));
    host.wait(1ms);
  }
  EXPECT_EQ(host.bus.servo(1).rom, wanted);
  EXPECT_EQ(host.bus.servo(1).ram, wanted);
  EXPECT_EQ(host.single_turn_cdeg(), 4500 - 2250);  // relative to the new zero
}

TEST(Memory, SettingIsRefusedWithoutPowerOrQueueSpace) {
  ServoConfig config = powered_drive();
  config.flash.write_time = 5ms;
  Host host(config);
  for (std::size_t n = 0; n < CanWire::kDriveQueue; ++n) {
    EXPECT_TRUE(host.bus.write_setting(1, RomParameter::kMaxSpeed, config.rom));
  }
  EXPECT_FALSE(host.bus.write_setting(1, RomParameter::kMaxSpeed, config.rom));
  supply(host, 0, 100ms);
  EXPECT_FALSE(host.bus.write_setting(1, RomParameter::kMaxSpeed, config.rom));
}

// --- failures of the ROM's storage

constexpr int kFirst = 0x0A, kSecond = 0x1A;  // angle Kp, as written
const protocol::Frame kWriteSecond = frame("141#32001A1B1C1D1E1F");

/// A drive whose flash takes 20 ms. Its first write is completed and collected, then reported lost.
struct LostWrite {
  LostWrite() {
    host.talk(kWriteGains, 20ms);
    host.bus.take_rom_writes(taken);
  }
  static ServoConfig config() {
    ServoConfig config = powered_drive();
    config.flash.write_time = 20ms;
    return config;
  }
  int angle_kp() const { return host.bus.servo(1).rom.gains.angle_kp; }
  void lose() { host.bus.restore_rom(1, before, wear_before); }

  Host host{config()};
  Registers before = host.bus.servo(1).rom;
  RomWear wear_before = host.bus.servo(1).wear;
  std::vector<RomWrite> taken;
};

TEST(Memory, LostWriteIsReverted) {
  LostWrite drive;
  ASSERT_EQ(drive.taken.size(), 1U);
  EXPECT_EQ(drive.angle_kp(), kFirst);
  drive.lose();
  EXPECT_EQ(drive.host.bus.servo(1).rom, drive.before);
  EXPECT_EQ(drive.host.bus.servo(1).wear, drive.wear_before);
}

/// Each write contains all earlier ones.
TEST(Memory, LaterWriteRestoresALostOneUnlessInterrupted) {
  struct Case {
    SimTime lost_after;  // since the later write
    bool power_loss;
  };
  for (const auto& [lost_after, power_loss] : {Case{20ms, false}, {5ms, false}, {5ms, true}}) {
    LostWrite drive;
    drive.host.talk(kWriteSecond, lost_after);
    drive.lose();
    if (lost_after == 20ms) {
      EXPECT_EQ(drive.angle_kp(), kSecond);
    }
    if (power_loss) supply(drive.host, 0, 0ns);
    drive.host.wait(100ms);
    EXPECT_EQ(drive.angle_kp(), power_loss ? drive.before.gains.angle_kp : kSecond);
    drive.host.bus.take_rom_writes(drive.taken);
    ASSERT_EQ(drive.taken.size(), power_loss ? 1U : 2U);
    EXPECT_EQ(drive.taken.back().rom.gains.angle_kp, power_loss ? kFirst : kSecond);
  }
}

}  // namespace power_test
}  // namespace lk::emulator
