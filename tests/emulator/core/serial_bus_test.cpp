// RS-485: timing of bytes, collisions, accepted packets and replies (docs/reference/rs485.md).

#include "tests/support/serial_bus.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>

#include "emulator/core/bus/serial_wire.hpp"
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

BusConfig two_drives() {
  return serial_bus({serial_drive(Generation::kV235), serial_drive(Generation::kV235, 2)});
}

/// Returns what the wire delivers until 1 s.
std::vector<WireDelivery> deliveries(SerialWire& wire) {
  std::vector<WireDelivery> read;
  for (int n = 0; n < 100 && wire.next_due(); ++n) {
    if (const auto delivery = wire.deliver(1s)) read.push_back(*delivery);
  }
  return read;
}

/// Time from the query's first bit to the reply's last, without the drive's reply time.
double transaction_us(std::string_view query, std::size_t reply_bytes, std::int64_t bitrate) {
  SerialHost host(serial_bus({serial_drive(Generation::kV235)}, bitrate));
  host.write(1ms, bytes(query));
  const auto replies = host.read_until(100ms);
  EXPECT_EQ(replies.size(), 1U) << query;
  EXPECT_EQ(protocol::wire_bytes(replies.at(0).frame).size, reply_bytes) << query;
  return std::chrono::duration<double, std::micro>(replies.at(0).at - 1ms - 150us).count();
}

struct Timing {
  const char* query;
  std::size_t reply_bytes;
  double us[5];  // at 115200, 460800, 1 M, 2 M, 4 M
};

TEST(SerialWire, TransactionTakesTenBitsPerByte) {
  const Timing table[] = {
      {"3E 9A 01 00 D9", 13, {1562.5, 390.6, 180, 90, 45}},
      {"3E A1 01 02 E2 64 00 64", 13, {1822.9, 455.7, 210, 105, 52.5}},
      {"3E A2 01 04 E5 A0 8C 00 00 2C", 13, {1996.5, 499.1, 230, 115, 57.5}},
      {"3E A4 01 0C EF 50 46 00 00 00 00 00 00 A0 8C 00 00 C2", 13, {2691, 672.7, 310, 155, 77.5}},
      {"3E 12 01 00 51", 64, {5989.6, 1497.4, 690, 345, 172.5}},
  };
  const std::int64_t rates[] = {115'200, 460'800, 1'000'000, 2'000'000, 4'000'000};
  for (const Timing& row : table) {
    for (std::size_t n = 0; n < std::size(rates); ++n) {
      const double measured = transaction_us(row.query, row.reply_bytes, rates[n]);
      const double bit_us = 1e6 / static_cast<double>(rates[n]);
      EXPECT_NEAR(measured, row.us[n], bit_us) << row.query << " at " << rates[n];
    }
  }
  // Without a bit rate only the drive's reply time counts.
  EXPECT_EQ(transaction_us("3E 9A 01 00 D9", 13, 0), 0);
}

TEST(SerialWire, HostBytesFollowBackToBack) {
  SerialHost host(two_drives());
  // The packet to drive 2 begins when that to the absent drive 5 ends.
  host.write(1ms, bytes("3E 9A 05 00 DD"));
  host.write(1ms, bytes("3E 9A 02 00 DA"));
  const auto replies = host.read_until(10ms);
  ASSERT_EQ(replies.size(), 1U);
  EXPECT_EQ(replies.front().at, 1ms + 50us + 50us + 150us + 130us);
}

/// After a client has left, the line carries at most the bytes that a serial port buffers: 0.36 s.
TEST(SerialWire, NoiseIsLimitedToTheBufferOfAPort) {
  SerialHost host(serial_bus({serial_drive(Generation::kV235)}, 115'200));
  host.write(1ms, test::Bytes(1'000'000, 0x55));
  EXPECT_GT(host.bus.stats().count(Drop::kQueueFull), 0U);
  // The buffer, the frame on the wire, and one that found room: ten bits per byte.
  const double noise_s = (4096 + 2.0 * protocol::kMaxBytes) * 10 / 115'200;
  host.read_until(1ms + SimTime(static_cast<std::int64_t>(noise_s * 1e9)));
  EXPECT_EQ(host.bus.stats().frames_waiting, 0U);
  host.read_until(host.bus.time() + 6ms);  // gap_ms
  EXPECT_NE(host.ask("3E 9A 01 00 D9"), "");
}

/// A host that writes 0xA1 and 0x92 together at 4 Mbit/s and reads both replies.
std::vector<TimedFrame> ask_back_to_back(SerialHost& host) {
  host.write(1ms, bytes("3E A1 01 02 E2 64 00 64 3E 92 01 00 D1"));
  return host.read_until(10ms);
}

TEST(SerialWire, PacketBeforeTheReplyIsAnsweredAfterIt) {
  SerialHost host(serial_bus({serial_drive(Generation::kV235)}, 4'000'000));
  const auto replies = ask_back_to_back(host);
  ASSERT_EQ(replies.size(), 2U);
  EXPECT_EQ(replies[0].frame.data[0], 0xA1);
  EXPECT_EQ(replies[1].frame.data[0], 0x92);
  // 8 bytes, the reply time, 13 bytes, and 14 more: ten bits of 0.25 µs each.
  EXPECT_EQ(replies[0].at, 1ms + 20us + 150us + 32'500ns);
  EXPECT_EQ(replies[1].at, replies[0].at + 35us);
  EXPECT_EQ(host.bus.stats().queries, 2U);
}

TEST(SerialWire, DriveLosesAPacketWhileReplying) {
  BusConfig half_duplex = serial_bus({serial_drive(Generation::kV235)}, 4'000'000);
  half_duplex.serial->receives_while_replying = false;
  SerialHost host(half_duplex);
  const auto replies = ask_back_to_back(host);
  ASSERT_EQ(replies.size(), 1U);
  EXPECT_EQ(replies.front().frame.data[0], 0xA1);
  EXPECT_EQ(host.bus.stats().count(Drop::kDriveBusy), 1U);
  // On a slower line the second packet overlaps the start of the first reply.
  SerialHost slow(serial_bus({serial_drive(Generation::kV235)}, 115'200));
  const auto spoiled = ask_back_to_back(slow);
  ASSERT_EQ(spoiled.size(), 1U);
  EXPECT_EQ(spoiled.front().frame.kind, protocol::FrameKind::kBytes);
  EXPECT_EQ(slow.bus.stats().queries, 1U);
}

TEST(SerialWire, SixteenRepliesWaitAndFurtherPacketsAreEffectsOfTheFault) {
  SerialHost host(serial_bus({serial_drive(Generation::kV235)}));
  ASSERT_TRUE(host.bus.apply({kWholeBus, SetFault{test::fault_of("queue_full", {}, {1})}}));
  for (int n = 0; n < 20; ++n) host.ask("3E 92 01 00 D1");
  EXPECT_EQ(host.bus.stats().replies_waiting, SerialWire::kDriveQueue);
  EXPECT_EQ(host.bus.stats().count(Drop::kDriveBusy), 20 - SerialWire::kDriveQueue);
  // 16 delayed replies and four ignored packets.
  EXPECT_EQ(host.bus.faults().front().evidence.effects, 20U);
}

/// Equal bytes pass: the packet has a correct sum, and ends with the reply.
TEST(SerialWire, DriveCannotReceiveWhileItSends) {
  SerialWire wire(1'000'000, {}, 1);
  const protocol::Frame both = packet("3E 88 01 00 C7");
  wire.send_from_drive(1ms, both, 0, 0x141, false);
  wire.send_from_host(1ms, both);
  EXPECT_TRUE(wire.cannot_receive(0x141, 1ms + 50us));
  EXPECT_FALSE(wire.cannot_receive(0x141, 1ms));
  EXPECT_FALSE(wire.cannot_receive(0x142, 1ms + 50us));
}

TEST(SerialWire, RepliesDoNotDependOnTimeSplits) {
  const auto run = [](SimTime step) {
    SerialHost host(two_drives());
    std::string text;
    const auto read = [&](SimTime until) {
      for (SimTime now = host.bus.time(); now < until; now = host.bus.time()) {
        for (const auto& reply : host.read_until(std::min(now + step, until))) {
          text += std::to_string(reply.at.count()) + " " + hex(reply.frame) + "\n";
        }
      }
    };
    for (int n = 0; n < 40; ++n) {
      const SimTime at = 1ms + n * 170us;
      read(at);
      host.write(at, n % 3 == 2 ? bytes("3E 3E 9A 02") : bytes("3E 9A 01 00 D9 3E 9C 02 00 DC"));
    }
    read(20ms);
    return text;
  };
  const std::string whole = run(20ms);
  EXPECT_GT(whole.size(), 500U);
  EXPECT_EQ(run(7us), whole);
}

const protocol::Frame kState2 = packet("3E 9C 01 07 E2 21 00 00 0D 00 2C 19 73");

TEST(SerialWire, EqualSimultaneousBytesPass) {
  SerialWire wire(1'000'000, {}, 1);
  wire.send_from_drive(1ms, kState2, 0, 0x141, false);
  wire.send_from_drive(1ms, packet("3E 9C 01 07 E2 22 00 00 0D 00 2C 19 74"), 0, 0x10141, false);
  auto read = deliveries(wire);
  std::erase_if(read, [](const WireDelivery& delivery) { return delivery.frame.dlc == 0; });
  // The host reads one line; temperature and its sum are spoiled.
  ASSERT_EQ(read.size(), 1U);
  const std::string line = hex(read[0].frame);
  EXPECT_EQ(line.substr(0, 14), "3E 9C 01 07 E2");
  EXPECT_EQ(line.substr(18, 17), "00 00 0D 00 2C 19");
  EXPECT_EQ(line.size(), 13 * 3 - 1U);
}

TEST(SerialWire, OverlappingRepliesSpoilTheirCommonBytes) {
  SerialWire wire(1'000'000, {}, 1);
  wire.send_from_drive(1ms, kState2, 0, 0x141, false);
  wire.send_from_drive(1ms + 105us, kState2, 0, 0x142, false);
  const auto read = deliveries(wire);
  ASSERT_EQ(read.size(), 2U);
  // Ten bytes of the first reply, which takes 130 µs, are complete when the second begins.
  EXPECT_EQ(read[0].at, 1ms + 130us);
  EXPECT_EQ(hex(read[0].frame).substr(0, 29), "3E 9C 01 07 E2 21 00 00 0D 00");
  EXPECT_EQ(read[0].frame.dlc, 13);
  // Bytes of the second that begin before 130 µs merge with those of the first.
  EXPECT_EQ(read[1].at, 1ms + 235us);
  EXPECT_EQ(hex(read[1].frame), "07 E2 21 00 00 0D 00 2C 19 73");
}

/// The reply begins 150 µs after the first query, at 200 µs, while the second is on the wire.
TEST(SerialWire, ReplyAndOverlappingQuerySpoilEachOther) {
  const auto spoiled = [](std::uint64_t seed) {
    BusConfig config = two_drives();
    config.seed = seed;
    SerialHost host(config);
    host.write(1ms, bytes("3E 9A 01 00 D9"));
    host.write(1ms + 190us, bytes("3E 9A 02 00 DA"));
    const auto replies = host.read_until(10ms);
    EXPECT_EQ(replies.size(), 1U);
    EXPECT_EQ(replies.at(0).frame.kind, protocol::FrameKind::kBytes);
    EXPECT_EQ(replies.at(0).at, 1ms + 50us + 150us + 130us);
    EXPECT_EQ(replies.at(0).frame.dlc, 13);  // hosts read this number of bytes, four of them wrong
    EXPECT_EQ(host.bus.stats().queries, 1U);
    EXPECT_EQ(host.bus.stats().count(Drop::kNoPacket), 1U);  // no drive received the second query
    return hex(replies.at(0).frame);
  };
  EXPECT_EQ(spoiled(1), spoiled(1));
  EXPECT_NE(spoiled(1), spoiled(2));
}

/// Returns the data of a reply from drive 1 as hexadecimal digits; "" means no reply.
std::string data_of(const std::string& reply) {
  return reply.size() < 18 ? "" : reply.substr(15, reply.size() - 18);
}

std::uint64_t dropped(const BusStats& stats) {
  return std::accumulate(stats.dropped.begin(), stats.dropped.end(), std::uint64_t{0});
}

TEST(SerialBus, RepliesOnceToItsOwnPackets) {
  SerialHost host(serial_drive(Generation::kV236));
  EXPECT_EQ(host.ask("3E 9A 01 00 D9").substr(0, 14), "3E 9A 01 07 E0");
  EXPECT_EQ(host.ask("3E 88 01 00 C7"), "3E 88 01 00 C7");
  EXPECT_EQ(host.ask(""), "");
  for (const char* unanswered :
       {"3E 9A 00 00 D8", "3E 9A 02 00 DA", "3E 9A 21 00 F9", "3E BB 01 00 FA", "3E 12 01 00 45",
        "3E 30 01 00 6F", "3E 40 01 02 81 96 00 96"}) {
    EXPECT_EQ(host.ask(unanswered), "") << unanswered;
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

TEST(SerialBus, PacketInPiecesOrAfterNoiseIsAnswered) {
  SerialHost host(serial_drive(Generation::kV236));
  host.write(host.bus.time(), bytes("3E 9A"));
  host.bus.advance_to(host.bus.time() + 4ms);  // less than the gap
  EXPECT_NE(host.ask("01 00 D9"), "");
  EXPECT_NE(host.ask("FF 3E 3E 3E 9A 01 00 D9"), "");
  host.write(host.bus.time(), bytes("3E 9A"));
  host.bus.advance_to(host.bus.time() + 6ms);
  EXPECT_EQ(host.ask("01 00 D9"), "");
  const BusStats stats = host.bus.stats();
  EXPECT_EQ(stats.frames, stats.queries + dropped(stats) + stats.frames_waiting);
}

TEST(SerialBus, RepliesAfterAnyNoise) {
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
  EXPECT_EQ(stats.frames, stats.queries + dropped(stats));
  EXPECT_EQ(host.bus.servo(1).stats.replies + host.bus.servo(2).stats.replies,
            stats.replies + stats.replies_lost);
}

TEST(SerialBus, ReplyTimeIsRandomWithinTheSpread) {
  ServoConfig drive = serial_drive(Generation::kV236);
  drive.reply_spread = 50us;
  SerialHost host(serial_bus({drive}));
  std::vector<SimTime> times;
  for (int n = 0; n < 200; ++n) {
    const SimTime at = host.bus.time();
    host.write(at, bytes("3E 9A 01 00 D9"));
    const auto replies = host.read_until(at + 2ms);
    ASSERT_EQ(replies.size(), 1U);
    times.push_back(replies[0].at - at - 180us);
  }
  const auto [first, last] = std::ranges::minmax(times);
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
TEST(SerialBus, ZeroWithoutPayloadUsesEarlierBytes) {
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

TEST(SerialBus, ClearTurnsKeepsTheSingleTurnAngle) {
  SerialHost host(serial_drive(Generation::kV235));
  host.ask("3E 95 01 00 D4");
  EXPECT_EQ(host.ask("3E 93 01 00 D2"), "3E 93 01 00 D2");
  // The shaft boots at 45°: 4500 = 0x1194.
  EXPECT_EQ(data_of(host.ask("3E 92 01 00 D1")), "94 11 00 00 00 00 00 00");
  EXPECT_EQ(data_of(host.ask("3E 94 01 00 D3")), "94 11 00 00");
}

TEST(SerialBus, ControlParametersReplyTheActiveValue) {
  SerialHost host(serial_drive(Generation::kV236));
  EXPECT_EQ(host.ask("3E C1 01 07 07 0A 64 00 14 00 05 00 87"),
            "3E C1 01 07 07 0A 64 00 14 00 05 00 87");
  EXPECT_EQ(host.ask("3E C0 01 07 06 0A (6 x 00) 0A"), "3E C0 01 07 06 0A 64 00 14 00 05 00 87");
  // 30000 (0x7530) is above every torque limit: 2048 = 0x0800.
  EXPECT_EQ(data_of(host.ask("3E C1 01 07 07 1E 00 00 30 75 00 00 C3")), "1E 00 00 D0 07 00 00");
  // Real hosts send it at D[1:2]: this writes 0 and looks successful.
  EXPECT_EQ(data_of(host.ask("3E C1 01 07 07 1E E8 03 00 00 00 00 09")), "1E 00 00 00 00 00 00");
}

TEST(SerialBus, SettingsAreReadAndWrittenUnknownOnesRefused) {
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
TEST(SerialBus, AnswersTheVendorsTool) {
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
  EXPECT_EQ(host.bus.servo(1).ram.max_speed_dps,
            host.bus.servo(1).config.profile.factory.max_speed_dps);
  EXPECT_EQ(host.ask("3E 48 01 00 87"), "3E 48 01 00 87");
  EXPECT_NE(host.bus.servo(1).ram.gains.angle_kp, 77);
}

TEST(SerialBus, ChipIdsAreUnique) {
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

TEST(SerialBus, LegacyDriveHasItsProductBlockAndNoReplyToZero) {
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

/// A slot is a gap and 130 bits, also for an absent drive. The query has 110 bits.
TEST(SerialBus, MultiDriveRepliesFollowInTimeSlots) {
  struct Case {
    std::int64_t bitrate;
    SimTime bit, gap;
  };
  for (const Case& c :
       {Case{1'000'000, 1us, 90us}, Case{2'000'000, 500ns, 45us}, Case{4'000'000, 250ns, 30us}}) {
    for (const bool complete : {true, false}) {
      BusConfig config = broadcast_bus(c.bitrate);
      if (!complete) config.servos.erase(config.servos.begin() + 1);
      SerialHost host(config);
      host.write(1ms, bytes(complete ? "02 80 64 00 00 00 9C FF 00 00 81"
                                     : "02 81 00 00 68 01 00 00 30 FD 19"));
      const auto replies = host.read_until(5ms);
      ASSERT_EQ(replies.size(), complete ? 4U : 3U);
      for (std::size_t n = 0; n < replies.size(); ++n) {
        const unsigned slot = static_cast<unsigned>(n) + (complete || n == 0 ? 1 : 2);
        EXPECT_EQ(replies[n].frame.id, 0x140 + slot);
        EXPECT_EQ(replies[n].frame.data[0], complete ? 0xA1 : 0xA2);
        const SimTime expected = 1ms + 110 * c.bit + slot * (c.gap + 130 * c.bit);
        // At 1 Mbit/s a bit is a whole number of microseconds.
        EXPECT_LE(std::chrono::abs(replies[n].at - expected), c.bit == 1us ? 0ns : c.bit);
      }
    }
  }
}

TEST(SerialBus, EachModeAcceptsItsPackets) {
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

TEST(SerialBus, DrivesWithOneIdSpoilTheirReplies) {
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

/// The host reads two equal bytes as one.
TEST(SerialBus, CollidedRepliesAreCounted) {
  ServoConfig twin = serial_drive(Generation::kV236b, 2);
  twin.rom.driver_id = 1;
  SerialHost host(serial_bus({serial_drive(Generation::kV236b), twin}));
  host.ask("3E 9A 01 00 D9");
  const BusStats stats = host.bus.stats();
  EXPECT_EQ(stats.replies, 1U);
  EXPECT_EQ(stats.replies_collided, 1U);
  EXPECT_EQ(stats.replies_lost, 1U);
}

}  // namespace serial_bus_test
}  // namespace lk::emulator
