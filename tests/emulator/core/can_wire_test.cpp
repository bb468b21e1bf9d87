// CAN frames: text, duration, arbitration. All frame lengths below were counted by hand. Stuff bits
// are in parentheses; 10 bits follow each frame (CRC delimiter, ACK slot and delimiter, end of
// frame):
//
//   141#9A00000000000000   12 stuff bits: 98 + 12 + 10 = 120 bits
//     00010100000(1)10001000100110100000(1)00000(1)00000(1)00000(1)00000(1)00000(1)00000(1)00000(1)
//     00000(1)00000(1)00111011100001001
//   142#9A00000000000000   11 stuff bits: 119 bits
//     0001010000100001000100110100000(1)00000(1)00000(1)00000(1)00000(1)00000(1)00000(1)00000(1)00000(1)
//     00000(1)00110101000100100
//   142#9A1900F000000000    8 stuff bits: 116 bits
//     0001010000100001000100110100001100100000(1)000111100000(1)00000(1)00000(1)00000(1)00000(1)00000(1)
//     0100001010001111
//   160#9A00000000000000   12 stuff bits: 120 bits
//     000101100000(1)0001000100110100000(1)00000(1)00000(1)00000(1)00000(1)00000(1)00000(1)00000(1)00000(1)
//     00000(1)00101000111011001
//   160#9A1900F000000000    9 stuff bits: 117 bits
//     000101100000(1)0001000100110100001100100000(1)000111100000(1)00000(1)00000(1)00000(1)00000(1)00000(1)
//     0111100101110010
//   280#0000000000000000   15 stuff bits: 123 bits
//     0010100000(1)00000(1)100000(1)00000(1) … 00010011100001000

#include "emulator/core/bus/can_wire.hpp"

#include <gtest/gtest.h>

#include "emulator/core/frame_text.hpp"
#include "emulator/core/wire_timing.hpp"
#include "tests/support/frames.hpp"

namespace lk::emulator {
namespace can_wire_test {

using namespace std::chrono_literals;
using protocol::FrameKind;
using test::frame;

std::string problem(std::string_view text) {
  const auto result = parse_frame(text);
  const auto* reason = std::get_if<std::string>(&result);
  return reason != nullptr ? *reason : "accepted";
}

protocol::Frame parsed(std::string_view text) {
  const auto result = parse_frame(text);
  const auto* good = std::get_if<protocol::Frame>(&result);
  EXPECT_NE(good, nullptr) << text;
  return good != nullptr ? *good : protocol::Frame{};
}

TEST(FrameText, RejectsNeighboursOfHexadecimalDigits) {
  for (const char c : {'/', ':', '@', 'G', '`', 'g', ' ', '-', 'x'}) {
    const std::string id = std::string("14") + c;
    EXPECT_EQ(problem(id + "#9C"),
              '"' + id + "\" is not an identifier of 3 or 8 hexadecimal digits");
    const std::string byte = std::string("9") + c;
    EXPECT_EQ(problem("141#" + byte), '"' + byte + "\" is not a byte of two hexadecimal digits");
  }
  EXPECT_EQ(parsed("7aF#09afAF"), test::frame("7AF#09AFAF"));
}

TEST(FrameText, Rs485BytesFollowItsName) {
  const protocol::Frame packet = parsed("rs485#3E9A0100D9");
  EXPECT_EQ(packet.kind, FrameKind::kSerial);
  EXPECT_EQ(packet.id, 0x141U);
  EXPECT_EQ(packet.dlc, 1);
  EXPECT_EQ(packet.data[0], 0x9A);
  EXPECT_EQ(frame_text(packet), "rs485#3E9A0100D9");
  // Raw bytes: a wrong sum, or bytes after the packet.
  for (const char* text : {"rs485#3E9A0100D8", "rs485#3E9A0100D900", "rs485#FF"}) {
    EXPECT_EQ(parsed(text).kind, FrameKind::kBytes) << text;
    EXPECT_EQ(frame_text(parsed(text)), text);
  }
  EXPECT_EQ(problem("rs485#"), "no bytes behind rs485#");
  EXPECT_EQ(problem("rs485#9"), "\"9\" is not a byte of two hexadecimal digits");
  EXPECT_EQ(problem("rs485#" + std::string(238, '0')), "more than 118 bytes of data");
}

TEST(FrameText, IdentifierHasThreeOrEightDigits) {
  for (const std::string id : {"", "1", "14", "0141", "0000141", "000000141"}) {
    EXPECT_EQ(problem(id + "#9C"),
              '"' + id + "\" is not an identifier of 3 or 8 hexadecimal digits");
  }
  EXPECT_EQ(parsed("7FF#").id, 0x7FFU);
  EXPECT_EQ(problem("800#"), "\"800\" is above 7FF; identifiers of 29 bits have 8 digits");
  EXPECT_EQ(parsed("1FFFFFFF#").id, 0x1FFFFFFFU);
  EXPECT_TRUE(parsed("1FFFFFFF#").extended);
  // Bits above the 29, and the flag of an error frame.
  EXPECT_EQ(problem("40000000#"), "\"40000000\" is above 1FFFFFFF");
  EXPECT_EQ(problem("80000141#9C"), "\"80000141\" is above 1FFFFFFF");
  EXPECT_EQ(parsed("20000040#").kind, FrameKind::kError);
}

TEST(FrameText, DotsSeparateBytesOnly) {
  EXPECT_EQ(parsed("141#9C.00.01"), test::frame("141#9C0001"));
  EXPECT_EQ(problem("141#.9C"), "\".9\" is not a byte of two hexadecimal digits");
  EXPECT_EQ(problem("141#9.C"), "\"9.\" is not a byte of two hexadecimal digits");
}

TEST(FrameText, RemoteRequestHasALength) {
  for (const char* text : {"141#R", "141#r", "141#R0", "141#r8"}) {
    EXPECT_EQ(parsed(text).kind, FrameKind::kRemote) << text;
    EXPECT_EQ(parsed(text).dlc, text[5] == '8' ? 8 : 0) << text;
  }
  EXPECT_EQ(problem("141#R9"), "\"R9\" does not request 0 to 8 bytes");
  EXPECT_EQ(problem("141#Rx"), "\"Rx\" does not request 0 to 8 bytes");
  EXPECT_EQ(problem("141#R000000001"), "\"R000000001\" does not request 0 to 8 bytes");
}

TEST(FrameText, WritesAtMostEightBytes) {
  protocol::Frame longer = test::frame("141#0102030405060708");
  longer.dlc = 15;  // a possible raw DLC
  EXPECT_EQ(frame_text(longer), "141#0102030405060708");
  longer.dlc = 2;
  EXPECT_EQ(frame_text(longer), "141#0102");
}

TEST(WireTiming, DurationOfBitsIsRoundedUp) {
  EXPECT_EQ(bits_duration(123, 1'000'000), 123us);
  EXPECT_EQ(bits_duration(123, 500'000), 246us);
  EXPECT_EQ(bits_duration(1, 800'000), 1250ns);
  EXPECT_EQ(bits_duration(1, 300'000), 3334ns);  // rounded up: a bit ends completely
  EXPECT_EQ(bits_duration(0, 1'000'000), 0ns);
}

TEST(WireTiming, TicksAreExactOverAYear) {
  EXPECT_EQ(ticks_until(0ns, 32000), 0);
  EXPECT_EQ(ticks_until(31249ns, 32000), 0);
  EXPECT_EQ(ticks_until(31250ns, 32000), 1);
  EXPECT_EQ(ticks_until(1s, 24000), 24000);
  EXPECT_EQ(ticks_until(41666ns, 24000), 0);  // 1/24000 s = 41666.6 ns
  EXPECT_EQ(ticks_until(41667ns, 24000), 1);
  // A year, for which t·f exceeds 64 bits, and one nanosecond less.
  const SimTime year = 365 * 24h;
  EXPECT_EQ(ticks_until(year, 32000), 365LL * 24 * 3600 * 32000);
  EXPECT_EQ(ticks_until(year - 1ns, 32000), 365LL * 24 * 3600 * 32000 - 1);
}

const protocol::Frame kQuery1 = frame("141#9A00000000000000");   // 120 bits
const protocol::Frame kQuery2 = frame("142#9A00000000000000");   // 119 bits
const protocol::Frame kQuery32 = frame("160#9A00000000000000");  // 120 bits
const protocol::Frame kReply2 = frame("142#9A1900F000000000");   // 116 bits
const protocol::Frame kReply32 = frame("160#9A1900F000000000");  // 117 bits
const protocol::Frame kMulti = frame("280#0000000000000000");    // 123 bits
constexpr SimTime kEnd = 1h;

void expect_next(CanWire& wire, SimTime at, const protocol::Frame& expected) {
  ASSERT_EQ(wire.next_due(), at);
  const auto delivery = wire.deliver(kEnd);
  ASSERT_TRUE(delivery);
  EXPECT_EQ(delivery->at, at);
  EXPECT_EQ(delivery->frame, expected);
}

TEST(CanWire, FrameTakesItsLength) {
  CanWire wire(1'000'000);
  EXPECT_EQ(wire.next_due(), std::nullopt);
  wire.send_from_host(10us, kQuery1);
  EXPECT_FALSE(wire.deliver(130us - 1ns));
  expect_next(wire, 130us, kQuery1);
  EXPECT_FALSE(wire.deliver(kEnd));
  EXPECT_EQ(wire.busy(), 123us);
}

struct Sent {
  SimTime at;
  protocol::Frame frame;
  bool from_drive = false;
};

struct Order {
  const char* name;
  std::vector<Sent> sent;
  // Without a time only the order counts.
  std::vector<std::pair<std::optional<SimTime>, protocol::Frame>> delivered;
  std::int64_t bitrate = 1'000'000;
};

constexpr bool kDrive = true;
const protocol::Frame kSecondReply2 = frame("142#9A1A00F000000000");
const protocol::Frame kRemote2 = frame("142#R");
const protocol::Frame kExtended2 = frame("05080000#");  // base identifier 0x142

const Order kOrders[] = {
    {"LengthScalesWithTheBitRate",
     {{0us, kQuery1}, {0us, kQuery2}},
     {{480us, kQuery1}, {492us + 476us, kQuery2}},
     250'000},
    {"FramesFollowAfterTheInterframeSpace",
     {{0us, kQuery1}, {0us, kQuery2}, {124us, kQuery32}},
     {{120us, kQuery1}, {123us + 119us, kQuery2}, {245us + 120us, kQuery32}}},
    // 0x142 against 0x160 when the wire becomes free at 123 µs.
    {"LowerIdentifierGoesFirst",
     {{0us, kQuery1}, {0us, kQuery32}, {50us, kReply2, kDrive}},
     {{120us, kQuery1}, {123us + 116us, kReply2}, {242us + 120us, kQuery32}}},
    {"HostWinsWithTheLowerIdentifier",
     {{0us, kQuery1}, {0us, kQuery2}, {50us, kReply32, kDrive}},
     {{120us, kQuery1}, {123us + 119us, kQuery2}, {245us + 117us, kReply32}}},
    // The adapter's queue is a FIFO: only its head takes part in arbitration.
    {"OnlyTheHeadOfTheHostQueueArbitrates",
     {{0us, kMulti}, {0us, kQuery32}, {0us, kQuery1}, {10us, kReply2, kDrive}},
     {{123us, kMulti},
      {126us + 116us, kReply2},
      {245us + 120us, kQuery32},
      {368us + 120us, kQuery1}}},
    {"LowerReplyGoesFirst",
     {{0us, kReply32, kDrive}, {0us, kReply2, kDrive}},
     {{116us, kReply2}, {119us + 117us, kReply32}}},
    {"ReplyGoesFirstWithEqualIdentifiers",
     {{0us, kQuery2}, {0us, kReply2, kDrive}},
     {{116us, kReply2}, {119us + 119us, kQuery2}}},
    // Queued later, so not sent before.
    {"HostQueueIsAFifoInTime",
     {{500us, kQuery1}, {100us, kQuery2}},
     {{620us, kQuery1}, {623us + 119us, kQuery2}}},
    {"RepliesOfOneDriveKeepTheirOrder",
     {{0us, kReply2, kDrive}, {1us, kSecondReply2, kDrive}, {0us, kQuery1}},
     {{{}, kQuery1}, {{}, kReply2}, {{}, kSecondReply2}}},
    {"DataBeatsRemoteAndStandardBeatsExtended",
     {{0us, kExtended2, kDrive}, {0us, kRemote2, kDrive}, {0us, kReply2, kDrive}},
     {{{}, kReply2}, {{}, kRemote2}, {{}, kExtended2}}},
};

TEST(CanWire, FramesArriveInTheOrderOfArbitration) {
  for (const Order& order : kOrders) {
    SCOPED_TRACE(order.name);
    CanWire wire(order.bitrate);
    for (const Sent& sent : order.sent) {
      sent.from_drive ? wire.send_from_drive(sent.at, sent.frame)
                      : wire.send_from_host(sent.at, sent.frame);
    }
    for (const auto& [at, expected] : order.delivered) {
      expect_next(wire, at ? *at : wire.next_due().value(), expected);
    }
  }
}

TEST(CanWire, SpoiledReplyOccupiesTheWireToItsEnd) {
  for (const SimTime dropped_at : {99us, 100us, 150us}) {
    CanWire wire(1'000'000);
    wire.send_from_drive(100us, kReply2);  // to 216 µs
    wire.send_from_drive(110us, kReply2);
    wire.send_from_host(120us, kQuery32);
    EXPECT_EQ(wire.next_reply_start(), 100us);
    EXPECT_EQ(wire.drop_replies(0x142, dropped_at), 2U);
    EXPECT_EQ(wire.next_reply_start(), std::nullopt);
    if (dropped_at < 100us) {
      expect_next(wire, 240us, kQuery32);
      EXPECT_EQ(wire.busy(), 123us);
    } else {
      expect_next(wire, 219us + 120us, kQuery32);
      EXPECT_EQ(wire.busy(), 119us + 123us);
    }
  }
}

TEST(CanWire, DroppedWaitingReplyDoesNotOccupyTheWire) {
  CanWire wire(1'000'000);
  wire.send_from_host(0us, kQuery1);
  wire.send_from_drive(50us, kReply2);
  EXPECT_EQ(wire.drop_replies(0x142, 60us), 1U);
  expect_next(wire, 120us, kQuery1);
  EXPECT_EQ(wire.busy(), 123us);
}

// Looking ahead decides nothing: a frame present at the start takes part, a frame one nanosecond
// later does not.
TEST(CanWire, ArbitrationIsDecidedAtTheStart) {
  for (const bool in_time : {true, false}) {
    CanWire wire(1'000'000);
    wire.send_from_drive(100us, kReply32);
    EXPECT_FALSE(wire.deliver(150us));
    EXPECT_EQ(wire.next_due(), 217us);
    wire.send_from_host(in_time ? 100us : 100us + 1ns, kQuery2);
    if (in_time) {
      expect_next(wire, 219us, kQuery2);
    } else {
      expect_next(wire, 217us, kReply32);
    }
  }
}

TEST(CanWire, FramesTakeNoTimeWithoutABitRate) {
  CanWire wire(0);
  wire.send_from_host(7us, kQuery32);
  wire.send_from_host(7us, kQuery1);
  expect_next(wire, 7us, kQuery32);
  wire.send_from_drive(7us, kReply32);
  expect_next(wire, 7us, kReply32);  // at once, although a lower identifier waits
  expect_next(wire, 7us, kQuery1);
  EXPECT_EQ(wire.busy(), 0ns);
}

}  // namespace can_wire_test
}  // namespace lk::emulator
