// Drives on RS-485: accepted bytes and replies (docs/reference/rs485.md).

#include "tests/support/serial_bus.hpp"

#include <gtest/gtest.h>

#include <random>

#include "tests/support/faults.hpp"

namespace lk::emulator {
namespace serial_bus_test {

using namespace std::chrono_literals;
using test::bytes;
using test::hex;
using test::packet;
using test::serial_bus;
using test::serial_drive;
using test::SerialHost;

/// Returns the data of a reply from drive 1 as hexadecimal digits; "" means no reply.
std::string data_of(const std::string& reply) {
  return reply.size() < 18 ? "" : reply.substr(15, reply.size() - 18);
}

TEST(SerialBus, OneReplyAndNothingUnasked) {
  SerialHost host(serial_drive(Generation::kV236));
  EXPECT_EQ(host.ask("3E 9A 01 00 D9").substr(0, 14), "3E 9A 01 07 E0");
  EXPECT_EQ(host.ask("3E 88 01 00 C7"), "3E 88 01 00 C7");
  EXPECT_EQ(host.ask(""), "");
  for (const char* silent : {"3E 9A 00 00 D8", "3E 9A 02 00 DA", "3E 9A 21 00 F9", "3E BB 01 00 FA",
                             "3E 12 01 00 45", "3E 30 01 00 6F", "3E 40 01 02 81 96 00 96"}) {
    EXPECT_EQ(host.ask(silent), "") << silent;
  }
  const BusStats stats = host.bus.stats();
  EXPECT_EQ(stats.queries, 2U);
  EXPECT_EQ(stats.replies, 2U);
  EXPECT_EQ(stats.count(Drop::kForeignId), 2U);
  EXPECT_EQ(stats.count(Drop::kNoSuchDrive), 1U);
  EXPECT_EQ(stats.count(Drop::kUnknownCommand), 3U);
  EXPECT_EQ(stats.count(Drop::kNoPacket), 1U);
  EXPECT_EQ(stats.receiver.bad_headers, 1U);
}

TEST(SerialBus, APacketInPiecesIsAnsweredAndSoIsOneBehindRubbish) {
  SerialHost host(serial_drive(Generation::kV236));
  host.write(host.bus.time(), bytes("3E 9A"));
  host.bus.advance_to(host.bus.time() + 4ms);  // less than the gap
  EXPECT_NE(host.ask("01 00 D9"), "");
  EXPECT_NE(host.ask("FF 3E 3E 3E 9A 01 00 D9"), "");
  host.write(host.bus.time(), bytes("3E 9A"));
  host.bus.advance_to(host.bus.time() + 6ms);
  EXPECT_EQ(host.ask("01 00 D9"), "");
  const BusStats stats = host.bus.stats();
  std::uint64_t dropped = 0;
  for (const std::uint64_t count : stats.dropped) dropped += count;
  EXPECT_EQ(stats.frames, stats.queries + dropped + stats.frames_waiting);
}

TEST(SerialBus, AnyBytesLeaveADriveThatAnswers) {
  std::mt19937 random(1);
  SerialHost host(
      serial_bus({serial_drive(Generation::kV235), serial_drive(Generation::kV236, 2)}));
  for (int n = 0; n < 300; ++n) {
    test::Bytes noise(1 + random() % 200);
    for (std::uint8_t& byte : noise) {
      byte = random() % 4 == 0 ? 0x3E : static_cast<std::uint8_t>(random() % 4 == 0 ? 1 : random());
    }
    host.write(host.bus.time() + std::chrono::microseconds(random() % 3000), noise);
  }
  host.read_until(host.bus.time() + 1s);
  EXPECT_NE(host.ask("3E 9A 02 00 DA"), "");
  const BusStats stats = host.bus.stats();
  std::uint64_t dropped = 0;
  for (const std::uint64_t count : stats.dropped) dropped += count;
  EXPECT_EQ(stats.frames, stats.queries + dropped);
  EXPECT_EQ(host.bus.servo(1).stats.replies + host.bus.servo(2).stats.replies,
            stats.replies + stats.replies_lost);
}

TEST(SerialBus, RepliesAreDrawnFromTheSpread) {
  ServoConfig drive = serial_drive(Generation::kV236);
  drive.reply_spread = 50us;
  SerialHost host(serial_bus({drive}));
  SimTime first{1s}, last{0};
  for (int n = 0; n < 200; ++n) {
    const SimTime at = host.bus.time();
    host.write(at, bytes("3E 9A 01 00 D9"));
    const auto replies = host.read_until(at + 2ms);
    ASSERT_EQ(replies.size(), 1U);
    const SimTime reply_time = replies[0].at - at - 180us;
    first = std::min(first, reply_time);
    last = std::max(last, reply_time);
  }
  EXPECT_GE(first, 100us);
  EXPECT_LE(last, 200us);
  EXPECT_LT(first, 110us);  // 200 numbers miss a tenth of the range once in 1.4e9 runs
  EXPECT_GT(last, 190us);
}

TEST(SerialBus, AnglesHave64Bits) {
  SerialHost host(serial_drive(Generation::kV236));
  host.ask("3E 95 01 07 DB (8 x 00)");
  EXPECT_EQ(data_of(host.ask("3E 92 01 00 D1")), "00 00 00 00 00 00 00 00");
  // 2^62 · 0.01° is valid, however far.
  EXPECT_NE(host.ask("3E A3 01 08 EA 00 00 00 00 00 00 00 40 40"), "");
  EXPECT_NE(host.ask("3E A7 01 04 EA FF FF FF 7F 7C"), "");
  EXPECT_NE(host.ask("3E A3 01 08 EA 00 00 00 00 00 00 00 80 80"), "");
}

/// The vendor's zeros, and the packets of real hosts (a real robot: +293 rad).
TEST(SerialBus, ZeroWithoutItsPayloadTakesWhatAnEarlierPacketLeft) {
  SerialHost host(serial_drive(Generation::kV236));
  EXPECT_EQ(host.ask("3E 95 01 00 D4"), "3E 95 01 00 D4");
  EXPECT_EQ(data_of(host.ask("3E 92 01 00 D1")), "00 00 00 01 00 00 00 00");  // no earlier packet
  EXPECT_EQ(host.ask("3E 95 01 07 DB (8 x 00)"), "3E 95 01 07 DB 00 00 00 00 00 00 00 00");
  EXPECT_EQ(data_of(host.ask("3E 92 01 00 D1")), "00 00 00 00 00 00 00 00");
  host.ask("3E C1 01 07 07 1E 00 00 E8 03 00 00 09");  // D[3:6] = 1000
  host.ask("3E 95 01 00 D4");
  EXPECT_EQ(data_of(host.ask("3E 92 01 00 D1")), "E8 03 00 00 00 00 00 00");
  SerialHost older(serial_drive(Generation::kV235));
  older.ask("3E 95 01 00 D4");
  EXPECT_EQ(data_of(older.ask("3E 92 01 00 D1")), "00 00 00 00 00 00 00 00");
  EXPECT_EQ(older.ask("3E 95 01 07 DB (8 x 00)"), "");
}

TEST(SerialBus, ClearTurnsGoesOnFromTheSingleTurnAngle) {
  SerialHost host(serial_drive(Generation::kV235));
  host.ask("3E 95 01 00 D4");
  EXPECT_EQ(host.ask("3E 93 01 00 D2"), "3E 93 01 00 D2");
  // The shaft boots at 45°: 4500 = 0x1194.
  EXPECT_EQ(data_of(host.ask("3E 92 01 00 D1")), "94 11 00 00 00 00 00 00");
  EXPECT_EQ(data_of(host.ask("3E 94 01 00 D3")), "94 11 00 00");
}

TEST(SerialBus, ControlParametersSayWhatIsInForce) {
  SerialHost host(serial_drive(Generation::kV236));
  EXPECT_EQ(host.ask("3E C1 01 07 07 0A 64 00 14 00 05 00 87"),
            "3E C1 01 07 07 0A 64 00 14 00 05 00 87");
  EXPECT_EQ(host.ask("3E C0 01 07 06 0A (6 x 00) 0A"), "3E C0 01 07 06 0A 64 00 14 00 05 00 87");
  // 30000 (0x7530) is above every torque limit: 2048 = 0x0800.
  EXPECT_EQ(data_of(host.ask("3E C1 01 07 07 1E 00 00 30 75 00 00 C3")), "1E 00 00 D0 07 00 00");
  // Real hosts send it at D[1:2]: this writes 0 and looks successful.
  EXPECT_EQ(data_of(host.ask("3E C1 01 07 07 1E E8 03 00 00 00 00 09")), "1E 00 00 00 00 00 00");
}

TEST(SerialBus, SettingsAreReadAndWrittenAndWhatIsNoneIsRefused) {
  SerialHost host(serial_drive(Generation::kV235));
  EXPECT_EQ(host.ask("3E 42 01 07 88 97 32 00 14 00 00 00 DD"), "3E 42 01 02 83 97 00 97");
  EXPECT_EQ(host.ask("3E 40 01 02 81 97 00 97"), "3E 40 01 07 86 97 32 00 14 00 00 00 DD");
  EXPECT_EQ(host.bus.servo(1).rom.gains.speed_kp, host.bus.servo(1).config.rom.gains.speed_kp);
  EXPECT_EQ(host.ask("3E 44 01 07 8A 97 32 00 14 00 00 00 DD"), "3E 44 01 02 85 97 00 97");
  EXPECT_EQ(host.bus.servo(1).rom.gains.speed_kp, 50);
  // Max Angle: 3600.00° = 0x057E40, in two halves.
  EXPECT_EQ(host.ask("3E 42 01 07 88 9B 40 7E 05 00 00 00 5E"), "3E 42 01 02 83 9B 00 9B");
  EXPECT_DOUBLE_EQ(host.bus.servo(1).ram.max_angle_deg, 3600);
  EXPECT_EQ(data_of(host.ask("3E 40 01 02 81 9C 00 9C")), "9C 00 00 00 00 00 00");
  EXPECT_EQ(host.ask("3E 42 01 07 88 01 32 00 14 00 00 00 47"), "3E 42 01 02 83 01 01 02");
  EXPECT_EQ(host.ask("3E 40 01 02 81 01 00 01"), "");
}

/// The vendor's tool fails with "reading failed" if one step is missing.
TEST(SerialBus, TheToolConnects) {
  SerialHost host(serial_bus({serial_drive(Generation::kV235, 1, Series::kMg)}));
  EXPECT_EQ(host.ask("3E 1F 01 00 5E"), "3E 1F 01 02 60 31 20 51");
  EXPECT_EQ(bytes(host.ask("3E 12 01 00 51")).size(), 64U);
  EXPECT_EQ(bytes(host.ask("3E 16 01 00 55")).size(), 6 + 108U);
  const std::string settings = host.ask("3E 14 01 00 53");
  ASSERT_EQ(bytes(settings).size(), 6 + 104U);
  EXPECT_EQ(host.ask("3E 10 01 00 4F"), "3E 10 01 00 4F");
  // Its offsets: ID and bus type at the start, Kp of the angle loop at 50.
  const test::Bytes all = bytes(settings);
  EXPECT_EQ(all[5], 1);
  EXPECT_EQ(all[5 + 1], 1);
  EXPECT_EQ(all[5 + 50], host.bus.servo(1).ram.gains.angle_kp);
  // Written back with another gain, the block is in RAM afterwards.
  protocol::Frame write = packet(settings);
  write.data[0] = 0x15;
  write.data[1 + 50] = 77;
  EXPECT_EQ(host.ask(hex(write)), "3E 15 01 00 54");
  EXPECT_EQ(host.bus.servo(1).ram.gains.angle_kp, 77);
  Registers as_it_was = host.bus.servo(1).config.profile.factory;
  as_it_was.gains.angle_kp = 77;
  EXPECT_EQ(host.bus.servo(1).ram.max_speed_dps, as_it_was.max_speed_dps);
  EXPECT_EQ(host.ask("3E 48 01 00 87"), "3E 48 01 00 87");
  EXPECT_NE(host.bus.servo(1).ram.gains.angle_kp, 77);
}

TEST(SerialBus, DrivesOfOneBusHaveTheirOwnChipIds) {
  ServoConfig first = serial_drive(Generation::kV235);
  first.profile.product.chip_id = {0x35, 0x37, 0x35, 0x30, 0x30, 0x32,
                                   0x73, 0x18, 0x78, 0x03, 0x4A, 0xFF};
  ServoConfig second = first;
  second.id = 2;
  SerialHost host(serial_bus({first, second}));
  const auto chip_id = [&](std::string_view query) {
    return data_of(host.ask(query)).substr(120, 35);
  };
  EXPECT_EQ(chip_id("3E 12 01 00 51"), "35 37 35 30 30 32 73 18 78 03 4A FF");
  EXPECT_EQ(chip_id("3E 12 02 00 52"), "35 37 35 30 30 32 73 18 78 03 4A 00");
}

TEST(SerialBus, TheOldestManualsDriveHasAProductOf42BytesAndZeroesInSilence) {
  SerialHost host(serial_drive(Generation::kLegacy));
  EXPECT_EQ(bytes(host.ask("3E 12 01 00 51")).size(), 6 + 42U);
  EXPECT_EQ(host.ask("3E 19 01 00 58"), "");
  EXPECT_EQ(host.bus.servo(1).stats.rom_writes, 1U);
  EXPECT_EQ(host.ask("3E 33 01 01 73 00 00").substr(0, 14), "3E 33 01 04 76");
}

// --- several drives at once

BusConfig broadcast_bus(std::int64_t bitrate) {
  std::vector<ServoConfig> drives;
  for (int id = 1; id <= 4; ++id) {
    drives.push_back(serial_drive(Generation::kV235, id));
    drives.back().rom.broadcast_mode = true;
  }
  return serial_bus(std::move(drives), bitrate);
}

TEST(SerialBus, APacketForSeveralIsAnsweredInTurnByTime) {
  BusConfig config = broadcast_bus(1'000'000);
  config.servos.erase(config.servos.begin() + 1);  // drive 2 is absent
  SerialHost host(config);
  host.write(1ms, bytes("02 81 00 00 68 01 00 00 30 FD 19"));
  const auto replies = host.read_until(5ms);
  ASSERT_EQ(replies.size(), 3U);
  // 110 bits of query, plus 90 µs and 130 bits per slot, also for absent drives.
  const int turns[] = {1, 3, 4};
  for (std::size_t n = 0; n < 3; ++n) {
    EXPECT_EQ(replies[n].at, 1ms + 110us + turns[n] * 220us) << n;
    EXPECT_EQ(replies[n].frame.data[0], 0xA2);
    EXPECT_EQ(replies[n].frame.id, 0x140U + static_cast<unsigned>(turns[n]));
  }
}

/// 11 + 4 · 13 bytes, without the waiting times before the replies.
TEST(SerialBus, FourRepliesTakeWhatTheTableSays) {
  struct Case {
    std::int64_t bitrate;
    double wire_us, gap_us;
  };
  for (const Case& one :
       {Case{1'000'000, 630, 90}, Case{2'000'000, 315, 45}, Case{4'000'000, 157.5, 30}}) {
    SerialHost host(broadcast_bus(one.bitrate));
    host.write(1ms, bytes("02 80 64 00 00 00 9C FF 00 00 81"));
    const auto replies = host.read_until(5ms);
    ASSERT_EQ(replies.size(), 4U);
    const double took_us = std::chrono::duration<double, std::micro>(replies[3].at - 1ms).count();
    EXPECT_NEAR(took_us - 4 * one.gap_us, one.wire_us, 1e6 / static_cast<double>(one.bitrate));
  }
}

TEST(SerialBus, EachModeHasItsPackets) {
  SerialHost several(broadcast_bus(1'000'000));
  EXPECT_EQ(several.ask("3E 9A 01 00 D9"), "");
  // 0x288: one of six commands; no drive answers others.
  const std::string states = several.ask("02 88 9C 00 9A 00 81 00 12 00 53");
  EXPECT_EQ(bytes(states).size(), 13 + 13 + 5U);
  // Printed by the vendor with a wrong sum; then with the right one.
  EXPECT_EQ(several.ask("02 88 9C 00 00 00 00 00 81 00 CF"), "");
  EXPECT_EQ(bytes(several.ask("02 88 9C 00 00 00 00 00 81 00 A7")).size(), 13 + 5U);
  // 180° to drive 1 are 180.00°.
  several.ask("02 82 50 46 00 00 00 00 D8 DC CE");
  const auto setpoint = several.bus.state().setpoint(1);
  ASSERT_TRUE(std::holds_alternative<model::Position>(setpoint));
  EXPECT_NEAR(several.bus.servo(1).angles.multi_turn_deg(std::get<model::Position>(setpoint).theta),
              180, 1e-9);
  SerialHost single(serial_drive(Generation::kV235));
  EXPECT_EQ(single.ask("02 81 00 00 68 01 00 00 30 FD 19"), "");
}

// --- faults of the link

TEST(SerialBus, TwoDrivesWithOneIdSpoilEachOther) {
  SerialHost host(serial_drive(Generation::kV235));
  ASSERT_TRUE(host.bus.apply({kWholeBus, SetFault{test::fault_of("duplicate_id", {}, {1})}}));
  EXPECT_NE(host.ask("3E A2 01 04 E5 A0 8C 00 00 2C"), "");
  int good = 0;
  for (int n = 0; n < 20; ++n) {
    const auto reply = host.ask("3E 9C 01 00 DB");
    good += reply.size() == 13 * 3 - 1 && protocol::packet_at(bytes(reply)) ? 1 : 0;
  }
  EXPECT_EQ(good, 0);
}

/// Two drives with one ID reply at the same time: the host reads two equal bytes as one.
TEST(SerialBus, RepliesThatCollideAreCountedAsSuch) {
  ServoConfig twin = serial_drive(Generation::kV236b, 2);
  twin.rom.driver_id = 1;
  SerialHost host(test::serial_bus({serial_drive(Generation::kV236b), twin}));
  host.ask("3E 9A 01 00 D9");
  const BusStats stats = host.bus.stats();
  EXPECT_EQ(stats.replies, 1U);
  EXPECT_EQ(stats.replies_collided, 1U);
  EXPECT_EQ(stats.replies_lost, stats.replies_collided);
}

}  // namespace serial_bus_test
}  // namespace lk::emulator
