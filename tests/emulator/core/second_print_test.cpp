// The second print of V2.36: settings, ID and bit rate over the bus, restart, zero, ranges
// (docs/reference/protocol.md §10.9). Frames by hand.

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <string_view>
#include <vector>

#include "emulator/core/generation.hpp"
#include "tests/emulator/core/core_support.hpp"
#include "tests/emulator/core/faults/fault_support.hpp"
#include "tests/support/test_bus.hpp"

namespace lk::emulator {
namespace second_print_test {

using namespace std::chrono_literals;
using test::frame;
using test::Host;
using test::send;

ServoConfig drive(int id = 7, Series series = Series::kMg) {
  return test::drive(Generation::kV236b, series, id);
}

BusConfig bus_of(std::initializer_list<ServoConfig> servos, std::int64_t bitrate = 0) {
  BusConfig config = test::bus_config({}, bitrate);
  config.servos = servos;
  return config;
}

// Frames to drive 7.
constexpr const char* kReadId = "147#40050A0000000000";
constexpr const char* kWriteId9 = "147#42050A0009000000";
constexpr const char* kSave = "147#4405FA0000000000";
constexpr const char* kRestart = "147#0700000000000000";

void save_id_9(Host& host) { send(host, {kWriteId9, kSave}); }

bool gets_no_reply(Host& host, std::string_view query) { return host.talk(frame(query)).empty(); }

TEST(V236b, GivesTheGoldenReplies) {
  Host host(drive());
  EXPECT_EQ(host.ask(kReadId), frame("147#40050A0007000000"));
  EXPECT_EQ(host.ask(kWriteId9), frame(kWriteId9));
  EXPECT_EQ(host.ask(kReadId), frame("147#40050A0009000000"));
  EXPECT_EQ(host.ask("147#42050D0003000000"), frame("147#42050D0003000000"));
  EXPECT_EQ(host.ask("147#4205E200407E0500"), frame("147#4205E200407E0500"));
  EXPECT_EQ(host.ask("147#42A0640014000500"), frame("147#42A0640014000500"));
  EXPECT_EQ(host.ask(kSave), frame("147#4405010000000000"));
  EXPECT_TRUE(gets_no_reply(host, kRestart));
}

TEST(V236b, FirstPrintDoesNotAnswerItsCommands) {
  Host host(test::drive(Generation::kV236, Series::kMg, 7));
  for (const char* query : {kReadId, kWriteId9, kSave, kRestart, "147#1800000000000000"}) {
    EXPECT_TRUE(gets_no_reply(host, query)) << query;
  }
  EXPECT_EQ(host.bus.servo(7).starts, 1U);
}

TEST(V236b, UnknownSettingsAndSavesGetNoReply) {
  Host host(drive());
  for (const char* query : {"147#4006000000000000", "147#4005010000000000", "147#40C0000000000000",
                            "147#42050E0001000000", "147#4405FB0000000000", "147#4404FA0000000000",
                            "147#3700000000000000", "147#3800000064000000"}) {
    EXPECT_TRUE(gets_no_reply(host, query)) << query;
  }
  // DATA[3] is ignored.
  EXPECT_EQ(host.ask("147#42050AFF09000000"), frame(kWriteId9));
}

TEST(V236b, SettingsActAfterTheRestart) {
  Host host(drive());
  struct Case {
    const char *write, *read;
  };
  for (const Case& one :
       {Case{"4205E000D0070000", "4005E00000000000"},  // 2000
        Case{"4205E200C0270900", "4005E20000000000"},  // 6000.00 dps
        Case{"4205E400A08C0000", "4005E40000000000"},  // 360.00°
        Case{"4205EA0030750000", "4005EA0000000000"},  // 30000
        Case{"4205EC00C0270900", "4005EC0000000000"},  // 600000 dps/s
        Case{"42A0010002000300", "40A0000000000000"}, Case{"42A4040005000600", "40A4000000000000"},
        Case{"42A8070008000900", "40A8000000000000"}}) {
    const std::string id = "147#";
    auto value = frame(id + one.write);
    EXPECT_EQ(host.ask(value), value);
    value.data[0] = 0x40;
    EXPECT_EQ(host.ask(id + one.read), value) << one.read;
  }
  // RAM is unchanged, as 0xC0 shows.
  EXPECT_EQ(host.ask("147#C00A000000000000"), frame("147#C00A640064000000"));
  const Registers before = host.bus.servo(7).ram;
  EXPECT_EQ(host.bus.stats().rom_writes, 0U);
  host.ask(kSave);
  EXPECT_EQ(host.bus.stats().rom_writes, 1U);
  EXPECT_EQ(host.bus.servo(7).ram, before);
  host.talk(frame(kRestart));
  const Registers& ram = host.bus.servo(7).ram;
  EXPECT_EQ(ram.max_torque_current_lsb, 2000);
  EXPECT_EQ(ram.max_speed_dps, 6000);
  EXPECT_EQ(ram.max_angle_deg, 360);
  EXPECT_EQ(ram.current_ramp_A_s, 30);
  EXPECT_EQ(ram.acceleration_dps_s, 600000);
  EXPECT_EQ(host.ask("147#C00A000000000000"), frame("147#C00A010002000300"));
  EXPECT_EQ(host.ask("147#C00B000000000000"), frame("147#C00B040005000600"));
  EXPECT_EQ(host.ask("147#C00C000000000000"), frame("147#C00C070008000900"));
}

TEST(V236b, ValuesOutOfRangeAreNotWritten) {
  Host host(drive());
  for (const auto& [write, kept] : {std::pair{"42050A0021000000", "42050A0007000000"},  // ID 33
                                    {"42050B0003000000", "42050B0002000000"},           // bus 3
                                    {"42050C000B000000", "42050C0004000000"},     // RS-485 rate 11
                                    {"42050D0005000000", "42050D0004000000"},     // CAN rate 5
                                    {"4205E000D1070000", "4205E000E8030000"},     // 2001
                                    {"4205E000FFFF0000", "4205E000E8030000"},     // −1
                                    {"4205E20001DD6D00", "4205E20080A21900"},     // 72000.01 dps
                                    {"42A0D10701000100", "42A0640064000000"}}) {  // Kp 2001
    EXPECT_EQ(host.ask(std::string("147#") + write), frame(std::string("147#") + kept)) << write;
  }
  EXPECT_FALSE(host.bus.servo(7).pending_parameters.any());
}

TEST(V236b, MaxPowerOfMsIsAtMost850) {
  Host host(drive(7, Series::kMs));
  EXPECT_EQ(host.ask("147#4205E00052030000"), frame("147#4205E00052030000"));  // 850
  EXPECT_EQ(host.ask("147#4205E00053030000"), frame("147#4205E00052030000"));
}

TEST(V236b, SavedIdActsAtTheRestart) {
  Host host(drive());
  save_id_9(host);
  EXPECT_EQ(host.bus.bus_address(7).id, 7);
  EXPECT_TRUE(gets_no_reply(host, "149#9C00000000000000"));
  host.talk(frame(kRestart));
  EXPECT_EQ(host.bus.bus_address(7).id, 9);
  EXPECT_TRUE(gets_no_reply(host, "147#9C00000000000000"));
  EXPECT_EQ(host.ask("149#40050A0000000000"), frame("149#40050A0009000000"));
  host.bus.power_cycle(7);
  EXPECT_EQ(host.ask("149#8100000000000000"), frame("149#8100000000000000"));
}

TEST(V236b, SavesOnlyPendingSettings) {
  Host host(drive());
  EXPECT_EQ(host.ask(kSave), frame("147#4405010000000000"));
  EXPECT_EQ(host.bus.stats().rom_writes, 0U);
  host.ask(kWriteId9);
  host.talk(frame(kRestart));  // without saving
  EXPECT_EQ(host.ask(kReadId), frame("147#40050A0007000000"));
}

TEST(V236b, IdZeroSelectsTheDipSwitch) {
  ServoConfig servo = drive();
  servo.dip_id = 3;
  Host host(servo);
  EXPECT_EQ(host.ask("147#42050A0000000000"), frame("147#42050A0000000000"));
  host.ask(kSave);
  host.talk(frame(kRestart));
  EXPECT_EQ(host.ask("143#40050A0000000000"), frame("143#40050A0000000000"));
}

TEST(V236b, DrivesWithOneIdBothReplyAndMove) {
  Host host(bus_of({drive(7), drive(9)}));
  save_id_9(host);
  host.talk(frame(kRestart));
  EXPECT_EQ(host.talk(frame("149#9C00000000000000")).size(), 2U);
  host.talk(frame("149#A200000040380000"));  // 144 dps
  host.wait(300ms);
  for (const int id : {7, 9}) EXPECT_GT(host.bus.telemetry(id).omega, 1.0) << id;
  const BusStats stats = host.bus.stats();
  EXPECT_EQ(stats.frames, 5U);
  EXPECT_EQ(stats.queries, 5U);
  EXPECT_EQ(stats.replies, 6U);  // 0x07 has no reply, and two queries have two
}

TEST(V236b, IdChangesAtWriteOrSaveIfConfigured) {
  for (const auto change : {IdChange::kWrite, IdChange::kSave}) {
    for (const auto reply : {IdChangeReply::kOld, IdChangeReply::kNew}) {
      ServoConfig servo = drive();
      servo.quirks.id_change = change;
      servo.quirks.id_change_reply = reply;
      Host host(servo);
      const std::string last = reply == IdChangeReply::kNew ? "149" : "147";
      if (change == IdChange::kWrite) {
        EXPECT_EQ(host.ask(kWriteId9), frame(last + "#42050A0009000000"));
      } else {
        EXPECT_EQ(host.ask(kWriteId9), frame(kWriteId9));
        EXPECT_EQ(host.ask(kSave), frame(last + "#4405010000000000"));
      }
      EXPECT_EQ(host.bus.servo(7).starts, 1U);
      EXPECT_TRUE(gets_no_reply(host, "147#8100000000000000"));
      EXPECT_EQ(host.ask("149#8100000000000000"), frame("149#8100000000000000"));
    }
  }
}

TEST(V236b, SettingReadShowsActiveValuesIfConfigured) {
  ServoConfig servo = drive();
  servo.quirks.setting_read = SettingRead::kActive;
  Host host(servo);
  EXPECT_EQ(host.ask(kWriteId9), frame(kWriteId9));
  EXPECT_EQ(host.ask(kReadId), frame("147#40050A0007000000"));
}

TEST(V236b, FailedWriteIsReported) {
  Host host(drive());
  test::inject(host, "rom_write_fails", {}, {}, {7});
  host.ask(kWriteId9);
  EXPECT_EQ(host.ask(kSave), frame("147#4405000000000000"));
  host.talk(frame(kRestart));
  EXPECT_EQ(host.bus.bus_address(7).id, 7);
}

TEST(V236b, SaveIsOneWriteAndWearsEachSettingOnce) {
  Host host(drive());
  send(host, {kWriteId9, "147#4205E200407E0500", kSave});
  const RomWear& wear = host.bus.servo(7).wear;
  EXPECT_EQ(wear[static_cast<std::size_t>(RomParameter::kDriverId)], 1U);
  EXPECT_EQ(wear[static_cast<std::size_t>(RomParameter::kMaxSpeed)], 1U);
  EXPECT_EQ(wear[static_cast<std::size_t>(RomParameter::kGains)], 0U);
  EXPECT_EQ(host.bus.stats().rom_writes, 1U);
}

TEST(V236b, AnotherBusTypeGetsNoReply) {
  Host host(drive());
  host.ask("147#42050B0001000000");  // RS-485
  host.ask(kSave);
  host.talk(frame(kRestart));
  EXPECT_TRUE(gets_no_reply(host, "147#9C00000000000000"));
  // Only access to the drive itself restores it.
  Registers value = host.bus.servo(7).rom;
  value.bus_type = 2;
  host.bus.write_setting(7, RomParameter::kBusType, value);
  EXPECT_FALSE(gets_no_reply(host, "147#9C00000000000000"));
}

TEST(V236b, AnotherBitRateDisturbsUntilErrorPassive) {
  Host host(bus_of({drive(7), drive(8)}, 1'000'000));
  host.talk(frame("147#42050D0003000000"), 2ms);  // 500 kbit/s
  host.talk(frame(kSave), 2ms);
  EXPECT_TRUE(host.talk(frame(kRestart), 2ms).empty());
  const auto received = host.talk(frame("148#9C00000000000000"), 20ms);
  // 128 in the receive error counter, in steps of 8: sixteen error frames, then the reply.
  EXPECT_EQ(host.bus.stats().error_frames, 16U);
  ASSERT_FALSE(received.empty());
  EXPECT_EQ(received.back().id, 0x148U);
  EXPECT_TRUE(host.talk(frame("147#9C00000000000000"), 5ms).empty());
  EXPECT_EQ(host.bus.stats().error_frames, 16U);
}

TEST(V236b, RestartClearsRam) {
  Host host(bus_of({drive(7)}, 1'000'000));
  host.talk(frame("147#C1200000E8030000"), 2ms);  // Max Speed 10 dps
  EXPECT_EQ(host.bus.servo(7).ram.max_speed_dps, 10);
  // The reply to the previous query has not left yet.
  host.bus.receive({host.bus.time(), frame("147#9C00000000000000")});
  host.bus.receive({host.bus.time(), frame(kRestart)});
  host.wait(5ms);
  EXPECT_EQ(host.bus.servo(7).starts, 2U);
  EXPECT_EQ(host.bus.servo(7).ram.max_speed_dps, host.bus.servo(7).rom.max_speed_dps);
}

TEST(V236b, ZeroSetsTheAngleToZeroAndStops) {
  Host host(drive());
  host.talk(frame("147#A200000040380000"));
  host.wait(500ms);
  EXPECT_GT(host.multi_turn_cdeg(7), 4500);
  // For any payload.
  EXPECT_EQ(host.ask("147#9500000012345678"), frame("147#9500000012345678"));
  EXPECT_EQ(host.multi_turn_cdeg(7), 0);
  EXPECT_EQ(host.run_state(7), RunState::kStopped);
}

TEST(V236b, ZeroInRomIsRepliedInFourBytes) {
  Host host(drive());
  const auto encoder = host.get<protocol::Encoder>(protocol::ReadEncoder{}, 7);
  const protocol::Frame reply = host.ask("147#1900000000000000");
  const unsigned raw = encoder.raw_counts;
  EXPECT_EQ(reply.data[4], raw & 0xFFU);
  EXPECT_EQ(reply.data[5], raw >> 8U);
  EXPECT_EQ(reply.data[6], 0);
  EXPECT_EQ(reply.data[7], 0);
}

TEST(V236b, ParametersAreClampedAndTheReplyShowsIt) {
  Host host(drive());
  EXPECT_EQ(host.ask("147#C120 0000 407E0500"), frame("147#C1200000407E0500"));
  EXPECT_EQ(host.ask("147#C120 0000 01DD6D00"), frame("147#C120000000DD6D00"));  // 72000.00 dps
  EXPECT_EQ(host.ask("147#C10AD10702000300"), frame("147#C10AD00702000300"));    // Kp 2000
  EXPECT_EQ(host.ask("147#C11E0000FF070000"), frame("147#C11E0000D0070000"));    // 2000
  EXPECT_EQ(host.ask("147#C1240000FFFFFF7F"), frame("147#C124000030750000"));    // 30000
  EXPECT_EQ(host.ask("147#C1260000FFFFFF7F"), frame("147#C1260000C0270900"));    // 600000
}

TEST(V236b, IdChangedFaultWritesTheRom) {
  Host host(drive());
  test::inject(host, "id_changed", {12.0}, {}, {7});
  EXPECT_EQ(host.bus.servo(7).wear[static_cast<std::size_t>(RomParameter::kDriverId)], 1U);
  EXPECT_TRUE(gets_no_reply(host, "147#8100000000000000"));
  EXPECT_EQ(host.ask("14C#8100000000000000"), frame("14C#8100000000000000"));
  host.bus.power_cycle(7);
  EXPECT_EQ(host.bus.bus_address(7).id, 12);
}

TEST(MaxTorqueCommands, LegacyDrivesStoreTheValueInRam) {
  Host host(test::drive(Generation::kLegacy, Series::kMf, 1));
  EXPECT_EQ(host.ask("141#3700000000000000"), frame("141#37000000E8030000"));
  EXPECT_EQ(host.ask("141#3800000064000000"), frame("141#3800000064000000"));
  EXPECT_EQ(host.ask("141#3700000000000000"), frame("141#3700000064000000"));
  EXPECT_EQ(host.ask("141#38000000FFFFFF7F"), frame("141#38000000FFFFFF7F"));
  EXPECT_EQ(host.ask("141#3700000000000000"), frame("141#37000000D0070000"));  // 2000
  host.bus.power_cycle(1);
  EXPECT_EQ(host.ask("141#3700000000000000"), frame("141#37000000E8030000"));
  EXPECT_EQ(host.bus.stats().rom_writes, 0U);
}

// Drives that take an ID or bit rate over (docs/reference/protocol.md §10.9), with effects of
// power, time and flash.

BusConfig two(std::int64_t bitrate = 0) {
  BusConfig config = test::bus_config({}, bitrate);
  for (const int id : {1, 7}) {
    config.servos.push_back(test::powered_drive(id));
    ServoConfig& servo = config.servos.back();
    servo.generation = Generation::kV236b;
    servo.quirks = quirks_of(Generation::kV236b);
    servo.profile.series = Series::kMg;
  }
  return config;
}

std::size_t replies_to(Host& host, std::string_view query, SimTime window = 0ns) {
  return host.talk(frame(query), window).size();
}

TEST(ChangedAddress, NewIdActsAtTheBootForAnyTimeSplit) {
  for (const bool split : {false, true}) {
    Host host(two());
    save_id_9(host);
    host.bus.apply({7, PowerOff{}});
    host.wait(1s);
    host.bus.apply({7, PowerOn{}});
    const SimTime query = host.bus.time() + 100ms;
    if (split) host.bus.advance_to(query - 1ms);
    host.bus.receive({query, frame("149#9C00000000000000")});
    const auto replies = test::run_until(host.bus, query);
    const auto id_of = [](const TimedFrame& reply) { return reply.frame.id; };
    EXPECT_EQ(std::ranges::count(replies, 0x149U, id_of), 1) << split;
  }
}

TEST(ChangedAddress, UnpoweredDriveDoesNotDisturbForAnyTimeSplit) {
  for (const bool split : {false, true}) {
    BusConfig config = two(1'000'000);
    config.servos[1].rom.can_rate = 3;
    config.servos[1].profile.drive.inverter.f_pwm = 16e3;  // its motor may lag
    Host host(config);
    host.bus.apply({7, PowerOff{}});
    const SimTime query = host.bus.time() + 1s;
    if (split) host.bus.advance_to(query - 1ms);
    host.bus.receive({query, frame("141#9C00000000000000")});
    host.bus.advance_to(query + 20ms);
    EXPECT_EQ(host.bus.stats().error_frames, 0U) << split;
  }
}

TEST(ChangedAddress, ChangedBitRateDisturbsUntilErrorPassiveOnly) {
  Host host(two(1'000'000));
  Registers value = host.bus.servo(7).rom;
  value.can_rate = 3;
  host.bus.write_setting(7, RomParameter::kCanRate, value);
  EXPECT_EQ(replies_to(host, "141#9C00000000000000", 20ms), 1U + 16U);
  host.bus.write_setting(7, RomParameter::kCanRate, value);  // unchanged value
  EXPECT_EQ(replies_to(host, "141#9C00000000000000", 20ms), 1U);
  value.can_rate = 4;
  host.bus.write_setting(7, RomParameter::kCanRate, value);
  EXPECT_EQ(replies_to(host, "147#9C00000000000000", 20ms), 1U);
  EXPECT_EQ(host.bus.stats().error_frames, 16U);
}

TEST(ChangedAddress, DuplicateChangesItsIdAsWell) {
  Host host(two());
  test::inject(host, "duplicate_id", {}, {}, {7});
  for (const char* query : {kWriteId9, kSave, kRestart}) host.talk(frame(query));
  EXPECT_EQ(replies_to(host, "147#9C00000000000000"), 0U);
  EXPECT_EQ(replies_to(host, "149#9C00000000000000"), 2U);
}

TEST(ChangedAddress, DuplicateHasTheBusTypeOfItsDrive) {
  BusConfig config = two();
  config.servos[1].rom.bus_type = 1;
  Host host(config);
  test::inject(host, "duplicate_id", {}, {}, {7});
  EXPECT_EQ(replies_to(host, "147#9C00000000000000"), 0U);
}

TEST(ChangedAddress, LostWriteIsSavedAgain) {
  Host host(two());
  const Registers before = host.bus.servo(7).rom;
  const RomWear wear = host.bus.servo(7).wear;
  save_id_9(host);
  host.wait(1ms);  // the flash has finished
  test::rom_writes_of(host.bus);
  host.bus.restore_rom(7, before, wear);
  EXPECT_EQ(host.bus.servo(7).rom, before);
  EXPECT_EQ(host.ask(kSave), frame("147#4405010000000000"));
  EXPECT_EQ(host.bus.servo(7).rom.driver_id, 9);
  EXPECT_EQ(host.bus.stats().rom_writes, 2U);
}

TEST(ChangedAddress, MultiDriveRepliesAreInOrderOfTheNewIds) {
  BusConfig config = two();
  for (ServoConfig& servo : config.servos) servo.rom.broadcast_mode = true;
  config.servos[0].rom.driver_id = 9;
  Host host(config);
  const auto replies = host.talk(frame("281#6801680168016801"));
  ASSERT_EQ(replies.size(), 2U);
  EXPECT_EQ(replies[0].id, 0x147U);
  EXPECT_EQ(replies[1].id, 0x149U);
}

}  // namespace second_print_test
}  // namespace lk::emulator
