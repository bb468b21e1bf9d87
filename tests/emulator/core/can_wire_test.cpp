// The wire alone. All frame lengths below were counted by hand. Stuff bits are in parentheses; 10
// bits follow each frame (CRC delimiter, ACK slot and delimiter, end of frame):
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

#include "tests/support/frames.hpp"

namespace lk::emulator {
namespace can_wire_test {

using namespace std::chrono_literals;
using test::frame;

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

TEST(CanWire, LengthScalesWithTheBitRate) {
  CanWire wire(250'000);
  wire.send_from_host(0us, kQuery1);
  wire.send_from_host(0us, kQuery2);
  expect_next(wire, 480us, kQuery1);
  expect_next(wire, 492us + 476us, kQuery2);
}

TEST(CanWire, FramesFollowAfterTheInterframeSpace) {
  CanWire wire(1'000'000);
  wire.send_from_host(0us, kQuery1);
  wire.send_from_host(0us, kQuery2);
  wire.send_from_host(124us, kQuery32);
  expect_next(wire, 120us, kQuery1);
  expect_next(wire, 123us + 119us, kQuery2);
  expect_next(wire, 245us + 120us, kQuery32);
}

TEST(CanWire, LowerIdentifierGoesFirst) {
  CanWire wire(1'000'000);
  wire.send_from_host(0us, kQuery1);
  wire.send_from_host(0us, kQuery32);
  wire.send_from_drive(50us, kReply2);  // 0x142 against 0x160 when the wire becomes free at 123 µs
  expect_next(wire, 120us, kQuery1);
  expect_next(wire, 123us + 116us, kReply2);
  expect_next(wire, 242us + 120us, kQuery32);
}

TEST(CanWire, HostWinsWithTheLowerIdentifier) {
  CanWire wire(1'000'000);
  wire.send_from_host(0us, kQuery1);
  wire.send_from_host(0us, kQuery2);
  wire.send_from_drive(50us, kReply32);
  expect_next(wire, 120us, kQuery1);
  expect_next(wire, 123us + 119us, kQuery2);
  expect_next(wire, 245us + 117us, kReply32);
}

// The adapter's queue is a FIFO: only its head takes part in arbitration.
TEST(CanWire, OnlyTheHeadOfTheHostQueueArbitrates) {
  CanWire wire(1'000'000);
  wire.send_from_host(0us, kMulti);
  wire.send_from_host(0us, kQuery32);
  wire.send_from_host(0us, kQuery1);
  wire.send_from_drive(10us, kReply2);
  expect_next(wire, 123us, kMulti);
  expect_next(wire, 126us + 116us, kReply2);
  expect_next(wire, 245us + 120us, kQuery32);
  expect_next(wire, 368us + 120us, kQuery1);
}

TEST(CanWire, RepliesAmongThemselves) {
  CanWire wire(1'000'000);
  wire.send_from_drive(0us, kReply32);
  wire.send_from_drive(0us, kReply2);
  expect_next(wire, 116us, kReply2);
  expect_next(wire, 119us + 117us, kReply32);
}

TEST(CanWire, ReplyGoesFirstWithEqualIdentifiers) {
  CanWire wire(1'000'000);
  wire.send_from_host(0us, kQuery2);
  wire.send_from_drive(0us, kReply2);
  expect_next(wire, 116us, kReply2);
  expect_next(wire, 119us + 119us, kQuery2);
}

TEST(CanWire, RepliesOfOneDriveKeepTheirOrder) {
  CanWire wire(1'000'000);
  auto second = kReply2;
  second.data[1] = 0x1A;
  wire.send_from_drive(0us, kReply2);
  wire.send_from_drive(1us, second);
  wire.send_from_host(0us, kQuery1);
  EXPECT_EQ(wire.deliver(kEnd)->frame, kQuery1);
  EXPECT_EQ(wire.deliver(kEnd)->frame, kReply2);
  EXPECT_EQ(wire.deliver(kEnd)->frame, second);
}

TEST(CanWire, ASpoiledReplyHasTheWireToItsEnd) {
  for (const SimTime died : {99us, 100us, 150us}) {
    CanWire wire(1'000'000);
    wire.send_from_drive(100us, kReply2);  // to 216 µs
    wire.send_from_drive(110us, kReply2);
    wire.send_from_host(120us, kQuery32);
    EXPECT_EQ(wire.next_reply_start(), 100us);
    EXPECT_EQ(wire.drop_replies(0x142, died), 2U);
    EXPECT_EQ(wire.next_reply_start(), std::nullopt);
    if (died < 100us) {
      expect_next(wire, 240us, kQuery32);
      EXPECT_EQ(wire.busy(), 123us);
    } else {
      expect_next(wire, 219us + 120us, kQuery32);
      EXPECT_EQ(wire.busy(), 119us + 123us);
    }
  }
}

TEST(CanWire, AFrameThatHasBegunIsNeitherBlockedNorReleased) {
  CanWire wire(1'000'000);
  wire.send_from_drive(100us, kReply2);  // to 216 µs
  wire.send_from_drive(110us, kReply2);
  EXPECT_EQ(wire.block(0x142, 150us), 1U);
  wire.release(0x142, 160us);
  expect_next(wire, 216us, kReply2);
  expect_next(wire, 219us + 116us, kReply2);
}

TEST(CanWire, WhoWaitsWhenItsDriveDiesNeverHadTheWire) {
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

TEST(CanWire, DataBeatsRemoteAndStandardBeatsExtended) {
  CanWire wire(1'000'000);
  const auto remote = frame("142#R");
  wire.send_from_drive(0us, frame("05080000#"));  // base identifier 0x142
  wire.send_from_drive(0us, remote);
  wire.send_from_drive(0us, kReply2);
  EXPECT_EQ(wire.deliver(kEnd)->frame, kReply2);
  EXPECT_EQ(wire.deliver(kEnd)->frame, remote);
  EXPECT_EQ(wire.deliver(kEnd)->frame, frame("05080000#"));
}

TEST(CanWire, HostQueueIsAFifoInTime) {
  CanWire wire(1'000'000);
  wire.send_from_host(500us, kQuery1);
  wire.send_from_host(100us, kQuery2);  // queued later, so not sent before
  expect_next(wire, 620us, kQuery1);
  expect_next(wire, 623us + 119us, kQuery2);
}

TEST(CanWire, HostQueueHasAnEnd) {
  CanWire wire(1'000'000);
  for (std::size_t k = 0; k < CanWire::kHostQueue; ++k) {
    ASSERT_FALSE(wire.host_queue_full());
    wire.send_from_host(0us, kQuery1);
  }
  EXPECT_TRUE(wire.host_queue_full());
  wire.deliver(kEnd);
  EXPECT_FALSE(wire.host_queue_full());
}

TEST(CanWire, WithoutABitRateNothingTakesTime) {
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
