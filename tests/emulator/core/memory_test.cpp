// Timing of the drive's ROM: writes, their completion, and interruptions.

#include <gtest/gtest.h>

#include "tests/support/test_bus.hpp"

namespace lk::emulator {
namespace memory_test {

using namespace std::chrono_literals;
using test::Host;
using test::powered_bus;
using test::powered_drive;

TEST(Memory, AReplyToAWriteComesWhenTheFlashIsDoneAndNobodyElseWaits) {
  BusConfig config = powered_bus({1, 2});
  config.servos[0].flash.write_time = 5ms;
  Host host(config);
  host.bus.receive({0ns, test::frame("141#32000A0B0C0D0E0F")});
  host.bus.receive({0ns, test::frame("141#9A00000000000000")});
  host.bus.receive({0ns, test::frame("142#9A00000000000000")});
  std::vector<TimedFrame> replies;
  std::vector<RomWrite> writes;
  host.wait(4999us);
  host.bus.take_replies(replies);
  host.bus.take_rom_writes(writes);
  ASSERT_EQ(replies.size(), 1U);
  EXPECT_EQ(replies[0].frame.id, 0x142U);
  EXPECT_TRUE(writes.empty());
  host.wait(1us);
  host.bus.take_replies(replies);
  host.bus.take_rom_writes(writes);
  ASSERT_EQ(replies.size(), 3U);
  EXPECT_EQ(replies[1], (TimedFrame{5ms, test::frame("141#32000A0B0C0D0E0F"), 1}));
  EXPECT_EQ(replies[2].frame.data[0], 0x9A);  // a drive replies in order
  EXPECT_EQ(replies[2].after_rom_write, 0U);
  ASSERT_EQ(writes.size(), 1U);
  EXPECT_EQ(writes[0].number, 1U);
  EXPECT_EQ(writes[0].rom.gains.speed_kp, 0x0C);
  EXPECT_EQ(writes[0].wear[0], 1U);
}

TEST(Memory, AWriteThatThePowerCutShortNeverWas) {
  ServoConfig config = powered_drive();
  config.flash.write_time = 20ms;
  Host host(config);
  host.bus.receive({0ns, test::frame("141#32000A0B0C0D0E0F")});
  host.bus.receive({0ns, test::frame("141#3200010203040506")});
  host.wait(10ms);
  host.bus.apply({1, SupplyVoltage{0.0, 0ns}});
  host.wait(100ms);
  host.bus.apply({1, SupplyVoltage{24.0, 0ns}});
  host.wait(100ms);
  std::vector<RomWrite> writes;
  host.bus.take_rom_writes(writes);
  EXPECT_TRUE(writes.empty());
  EXPECT_EQ(host.ask("141#3000000000000000"), test::frame("141#3000646432283232"));  // factory
  EXPECT_EQ(host.bus.servo(1).wear[0], 0U);
}

TEST(Memory, WornCellsKeepWhatTheyHave) {
  ServoConfig config = powered_drive();
  config.flash = {.write_time = 0ns, .endurance = 2};
  Host host(config);
  host.ask("141#3200010101010101");
  host.ask("141#3200020202020202");
  EXPECT_EQ(host.ask("141#3200030303030303"), test::frame("141#3200030303030303"));
  EXPECT_EQ(host.ask("141#3000000000000000"), test::frame("141#3000030303030303"));  // RAM
  host.ask("141#91000000000000FF");  // another parameter has its own cells
  host.bus.apply({1, PowerCycle{}});
  host.wait(1s);
  EXPECT_EQ(host.ask("141#3000000000000000"), test::frame("141#3000020202020202"));
  EXPECT_EQ(host.bus.servo(1).wear[0], 2U);
}

/// A host that writes ROM 15 times as fast as the flash: 5 s of that on two drives.
TEST(Memory, AHostThatWritesFasterThanTheFlashIsNotTakenIn) {
  for (const std::int64_t bitrate : {std::int64_t{0}, std::int64_t{1'000'000}}) {
    BusConfig config = powered_bus({1, 2}, bitrate);
    config.servos[0].flash.write_time = 2ms;
    Host host(config);
    std::vector<RomWrite> writes;
    std::uint64_t busy_before = 0;
    for (int n = 0; n < 37'500; ++n) {
      const SimTime at = n * 133us;
      host.bus.advance_to(at);
      host.bus.receive({at, test::frame("141#32000A0B0C0D0E0F")});
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
    host.bus.take_rom_writes(writes);
    EXPECT_EQ(writes.size(), stats.queries);
    std::vector<TimedFrame> replies;
    host.bus.take_replies(replies);
    EXPECT_EQ(host.talk(test::frame("142#9C00000000000000"), 1ms).size(), 1U);
  }
}

TEST(Power, AFrameThatItsDriveCouldNotFinishKeepsTheOthersOffTheWire) {
  BusConfig config = powered_bus({1, 2}, 10'000);  // a frame takes 12 ms
  config.servos[0].reply_time = 0ns;
  config.servos[1].reply_time = 0ns;
  Host host(config);
  host.bus.receive({0ns, test::frame("141#9A00000000000000")});
  host.wait(12ms + 300us);  // the reply is on the wire
  host.bus.apply({1, SupplyVoltage{0.0, 0ns}});
  host.bus.receive({13ms, test::frame("142#9A00000000000000")});
  host.wait(27ms);
  std::vector<TimedFrame> replies;
  host.bus.take_replies(replies);
  EXPECT_TRUE(replies.empty());
  EXPECT_EQ(host.bus.stats().replies_lost, 1U);
  host.wait(12ms);
  host.bus.take_replies(replies);
  ASSERT_EQ(replies.size(), 1U);  // after the query, the spoiled frame and the other query
  EXPECT_GT(replies[0].at, 4 * 11ms);
}

TEST(Memory, ASettingIsInForceAtOnceAndSurvivesWhenTheFlashIsDone) {
  ServoConfig config = powered_drive();
  config.flash = {.write_time = 5ms, .endurance = 2};
  Host host(config);
  Registers wanted = config.rom;
  wanted.max_speed_dps = 90;
  wanted.broadcast_mode = true;  // another setting
  ASSERT_TRUE(host.bus.write_setting(1, RomParameter::kMaxSpeed, wanted));
  EXPECT_EQ(host.bus.servo(1).ram.max_speed_dps, 90);
  host.ask("141#A3000000A08C0000");  // to 360.00 degrees
  std::vector<RomWrite> writes;
  host.wait(4ms);
  host.bus.take_rom_writes(writes);
  EXPECT_TRUE(writes.empty());
  host.wait(1ms);
  host.bus.take_rom_writes(writes);
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

TEST(Memory, ASettingIsNotWrittenByADeadDriveNorByOneWithoutTime) {
  ServoConfig config = powered_drive();
  config.flash.write_time = 5ms;
  Host host(config);
  for (std::size_t n = 0; n < CanWire::kDriveQueue; ++n) {
    EXPECT_TRUE(host.bus.write_setting(1, RomParameter::kMaxSpeed, config.rom));
  }
  EXPECT_FALSE(host.bus.write_setting(1, RomParameter::kMaxSpeed, config.rom));
  host.bus.apply({1, SupplyVoltage{0.0, 0ns}});
  host.wait(100ms);
  EXPECT_FALSE(host.bus.write_setting(1, RomParameter::kMaxSpeed, config.rom));
}

// --- failures of the ROM's storage

constexpr int kFirst = 0x0A, kSecond = 0x1A;  // angle Kp, as written
const protocol::Frame kWriteFirst = test::frame("141#32000A0B0C0D0E0F");
const protocol::Frame kWriteSecond = test::frame("141#32001A1B1C1D1E1F");

/// A drive whose flash takes 20 ms. Its first write is completed and collected, then reported lost.
struct LostWrite {
  LostWrite() {
    host.talk(kWriteFirst, 20ms);
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

TEST(Memory, ALostWriteIsTakenBack) {
  LostWrite drive;
  ASSERT_EQ(drive.taken.size(), 1U);
  EXPECT_EQ(drive.angle_kp(), kFirst);
  drive.lose();
  EXPECT_EQ(drive.host.bus.servo(1).rom, drive.before);
  EXPECT_EQ(drive.host.bus.servo(1).wear, drive.wear_before);
}

TEST(Memory, ALaterWriteBringsTheLostOneWithIt) {
  LostWrite drive;
  drive.host.talk(kWriteSecond, 20ms);
  drive.lose();  // before the later write is collected
  EXPECT_EQ(drive.angle_kp(), kSecond);
  drive.host.bus.take_rom_writes(drive.taken);
  ASSERT_EQ(drive.taken.size(), 2U);
  EXPECT_EQ(drive.taken[1].rom.gains.angle_kp, kSecond);
}

TEST(Memory, ALaterWriteThatIsCutShortBringsNothing) {
  for (const bool cut : {false, true}) {
    LostWrite drive;
    drive.host.talk(kWriteSecond, 5ms);
    drive.lose();
    if (cut) drive.host.bus.apply({1, SupplyVoltage{0.0, 0ns}});
    drive.host.wait(100ms);
    EXPECT_EQ(drive.angle_kp(), cut ? drive.before.gains.angle_kp : kSecond);
    drive.host.bus.take_rom_writes(drive.taken);
    EXPECT_EQ(drive.taken.size(), cut ? 1U : 2U);
  }
}

}  // namespace memory_test
}  // namespace lk::emulator
