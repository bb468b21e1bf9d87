// RS-485 as a wire: timing of bytes and collisions (docs/reference/rs485.md).

#include "emulator/core/bus/serial_wire.hpp"

#include <gtest/gtest.h>

#include "tests/support/faults.hpp"
#include "tests/support/serial_bus.hpp"

namespace lk::emulator {
namespace serial_wire_test {

using namespace std::chrono_literals;
using test::bytes;
using test::hex;
using test::packet;
using test::serial_bus;
using test::serial_drive;
using test::SerialHost;

/// Time from the query's first bit to the reply's last, without the drive's reply time.
double transaction_us(std::string_view query, std::size_t reply_bytes, Generation generation,
                      std::int64_t bitrate) {
  SerialHost host(serial_bus({serial_drive(generation)}, bitrate));
  host.write(1ms, bytes(query));
  const auto replies = host.read_until(100ms);
  EXPECT_EQ(replies.size(), 1U) << query;
  if (replies.empty()) return 0;
  EXPECT_EQ(protocol::wire_bytes(replies.front().frame).size, reply_bytes) << query;
  return std::chrono::duration<double, std::micro>(replies.front().at - 1ms - 150us).count();
}

struct Timing {
  const char* query;
  std::size_t reply_bytes;
  Generation generation;
  double us[5];  // at 115200, 460800, 1 M, 2 M, 4 M
};

TEST(SerialWire, ATransactionTakesTenBitsAByte) {
  const Timing table[] = {
      {"3E 9A 01 00 D9", 13, Generation::kV236, {1562.5, 390.6, 180, 90, 45}},
      {"3E A1 01 02 E2 64 00 64", 13, Generation::kV236, {1822.9, 455.7, 210, 105, 52.5}},
      {"3E A2 01 04 E5 A0 8C 00 00 2C", 13, Generation::kV236, {1996.5, 499.1, 230, 115, 57.5}},
      {"3E A4 01 0C EF 50 46 00 00 00 00 00 00 A0 8C 00 00 C2",
       13,
       Generation::kV236,
       {2691.0, 672.7, 310, 155, 77.5}},
      {"3E 12 01 00 51", 64, Generation::kV235, {5989.6, 1497.4, 690, 345, 172.5}},
  };
  const std::int64_t rates[] = {115'200, 460'800, 1'000'000, 2'000'000, 4'000'000};
  for (const Timing& row : table) {
    for (std::size_t n = 0; n < std::size(rates); ++n) {
      const double measured = transaction_us(row.query, row.reply_bytes, row.generation, rates[n]);
      const double bit_us = 1e6 / static_cast<double>(rates[n]);
      EXPECT_NEAR(measured, row.us[n], bit_us) << row.query << " at " << rates[n];
    }
  }
}

TEST(SerialWire, WithoutABitRateBytesTakeNoTimeAndRepliesTheirs) {
  EXPECT_EQ(transaction_us("3E 9A 01 00 D9", 13, Generation::kV236, 0), 0);
}

TEST(SerialWire, HostsBytesStandBackToBackWhateverTheyWrite) {
  SerialHost host(
      serial_bus({serial_drive(Generation::kV235), serial_drive(Generation::kV235, 2)}));
  // The packet to drive 2 begins when that to the absent drive 5 ends.
  host.write(1ms, bytes("3E 9A 05 00 DD"));
  host.write(1ms, bytes("3E 9A 02 00 DA"));
  const auto replies = host.read_until(10ms);
  ASSERT_EQ(replies.size(), 1U);
  EXPECT_EQ(replies.front().at, 1ms + 50us + 50us + 150us + 130us);
}

/// After a client has left, the line carries at most the bytes that a serial port buffers: 0.36 s.
TEST(SerialWire, AMegabyteOfNoiseLeavesTheLineSoon) {
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

/// The reply begins 150 µs after the first query, while the second query is on the wire.
TEST(SerialWire, AReplyThatMeetsAnotherQueryIsSpoiledWithIt) {
  SerialHost host(
      serial_bus({serial_drive(Generation::kV235), serial_drive(Generation::kV235, 2)}));
  host.write(1ms, bytes("3E 9A 01 00 D9"));
  host.write(1ms + 190us, bytes("3E 9A 02 00 DA"));  // the reply begins at 200 µs
  const auto replies = host.read_until(10ms);
  ASSERT_EQ(replies.size(), 1U);
  EXPECT_EQ(replies.front().frame.kind, protocol::FrameKind::kBytes);
  EXPECT_EQ(replies.front().at, 1ms + 50us + 150us + 130us);
  EXPECT_EQ(replies.front().frame.dlc, 13);  // hosts read this number of bytes, four of them wrong
  EXPECT_EQ(host.bus.stats().queries, 1U);
  EXPECT_EQ(host.bus.stats().count(Drop::kNoPacket), 1U);  // no drive received the second query
}

/// A host that writes 0xA1 and 0x92 together at 4 Mbit/s and reads both replies.
std::vector<TimedFrame> ask_back_to_back(SerialHost& host) {
  host.write(1ms, bytes("3E A1 01 02 E2 64 00 64 3E 92 01 00 D1"));
  return host.read_until(10ms);
}

TEST(SerialWire, APacketThatEndsBeforeTheReplyBeginsIsAnsweredBehindIt) {
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

TEST(SerialWire, ADriveThatDoesNotHearWhileReplyingLosesThatPacket) {
  BusConfig config = serial_bus({serial_drive(Generation::kV235)}, 4'000'000);
  config.serial->receives_while_replying = false;
  SerialHost host(config);
  const auto replies = ask_back_to_back(host);
  ASSERT_EQ(replies.size(), 1U);
  EXPECT_EQ(replies.front().frame.data[0], 0xA1);
  EXPECT_EQ(host.bus.stats().count(Drop::kDriveBusy), 1U);
}

TEST(SerialWire, SixteenRepliesWaitAndFurtherPacketsShowInTheFault) {
  SerialHost host(serial_bus({serial_drive(Generation::kV235)}));
  ASSERT_TRUE(host.bus.apply({kWholeBus, SetFault{test::fault_of("queue_full", {}, {1})}}));
  for (int n = 0; n < 20; ++n) host.ask("3E 92 01 00 D1");
  EXPECT_EQ(host.bus.stats().replies_waiting, SerialWire::kDriveQueue);
  EXPECT_EQ(host.bus.stats().count(Drop::kDriveBusy), 20 - SerialWire::kDriveQueue);
  // 16 delayed replies and four ignored packets.
  EXPECT_EQ(host.bus.faults().front().evidence.effects, 20U);
}

/// On a slower line the second packet overlaps the start of the first reply.
TEST(SerialWire, ADriveDoesNotHearAPacketThatItsReplyMeets) {
  SerialHost host(serial_bus({serial_drive(Generation::kV235)}, 115'200));
  const auto replies = ask_back_to_back(host);
  ASSERT_EQ(replies.size(), 1U);
  EXPECT_EQ(replies.front().frame.kind, protocol::FrameKind::kBytes);
  EXPECT_EQ(host.bus.stats().queries, 1U);
}

/// Equal bytes pass: the packet has a correct sum, and ends with the reply.
TEST(SerialWire, ADriveDoesNotHearItselfWithAHost) {
  SerialWire wire(1'000'000, {}, 1);
  const protocol::Frame both = packet("3E 88 01 00 C7");
  wire.send_from_drive(1ms, both, 0, 0x141, false);
  wire.send_from_host(1ms, both);
  EXPECT_TRUE(wire.cannot_receive(0x141, 1ms + 50us));
  EXPECT_FALSE(wire.cannot_receive(0x141, 1ms));
  EXPECT_FALSE(wire.cannot_receive(0x142, 1ms + 50us));
}

TEST(SerialWire, EqualBytesAtTheSameTimePass) {
  SerialWire wire(1'000'000, {}, 1);
  const protocol::Frame reply = packet("3E 9C 01 07 E2 21 00 00 0D 00 2C 19 73");
  protocol::Frame other = packet("3E 9C 01 07 E2 22 00 00 0D 00 2C 19 74");
  wire.send_from_drive(1ms, reply, 0, 0x141, false);
  wire.send_from_drive(1ms, other, 0, 0x10141, false);
  std::vector<std::string> read;
  for (int n = 0; n < 100 && wire.next_due(); ++n) {
    if (const auto delivery = wire.deliver(1s)) {
      if (delivery->frame.dlc > 0) read.push_back(hex(delivery->frame));
    }
  }
  // The host reads one line; temperature and its sum are spoiled.
  ASSERT_EQ(read.size(), 1U);
  EXPECT_EQ(read[0].substr(0, 14), "3E 9C 01 07 E2");
  EXPECT_EQ(read[0].substr(18, 17), "00 00 0D 00 2C 19");
  EXPECT_EQ(read[0].size(), 13 * 3 - 1U);
}

TEST(SerialWire, TwoRepliesThatOverlapSpoilWhatOverlaps) {
  SerialWire wire(1'000'000, {}, 1);
  const protocol::Frame reply = packet("3E 9C 01 07 E2 21 00 00 0D 00 2C 19 73");
  wire.send_from_drive(1ms, reply, 0, 0x141, false);
  wire.send_from_drive(1ms + 105us, reply, 0, 0x142, false);
  std::vector<WireDelivery> read;
  for (int n = 0; n < 100 && wire.next_due(); ++n) {
    if (const auto delivery = wire.deliver(1s)) read.push_back(*delivery);
  }
  ASSERT_EQ(read.size(), 2U);
  // Ten bytes of the first reply, which takes 130 µs, are complete when the second begins.
  EXPECT_EQ(read[0].at, 1ms + 130us);
  EXPECT_EQ(hex(read[0].frame).substr(0, 29), "3E 9C 01 07 E2 21 00 00 0D 00");
  EXPECT_EQ(read[0].frame.dlc, 13);
  // Bytes of the second that begin before 130 µs merge with those of the first.
  EXPECT_EQ(read[1].at, 1ms + 235us);
  EXPECT_EQ(hex(read[1].frame), "07 E2 21 00 00 0D 00 2C 19 73");
}

TEST(SerialWire, TheSameSeedSpoilsInTheSameWay) {
  const auto spoiled = [](std::uint64_t seed) {
    BusConfig config =
        serial_bus({serial_drive(Generation::kV235), serial_drive(Generation::kV235, 2)});
    config.seed = seed;
    SerialHost host(config);
    host.write(1ms, bytes("3E 9A 01 00 D9"));
    host.write(1ms + 190us, bytes("3E 9A 02 00 DA"));
    return hex(host.read_until(10ms).front().frame);
  };
  EXPECT_EQ(spoiled(1), spoiled(1));
  EXPECT_NE(spoiled(1), spoiled(2));
}

TEST(SerialWire, TimeSplitOtherwiseGivesTheSame) {
  const auto run = [](SimTime step) {
    SerialHost host(
        serial_bus({serial_drive(Generation::kV235), serial_drive(Generation::kV235, 2)}));
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

}  // namespace serial_wire_test
}  // namespace lk::emulator
