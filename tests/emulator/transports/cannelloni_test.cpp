// Bytes by hand from cannelloni's doc/udp_format.md: version 2, op code 0, number, count; then
// identifier as in linux/can.h, length, data, all in the byte order of networks.

#include "emulator/transports/cannelloni.hpp"

#include <gtest/gtest.h>

#include <array>
#include <string>

#include "tests/support/frames.hpp"
#include "tests/support/serial.hpp"

namespace lk::emulator {
namespace cannelloni_test {

using protocol::Frame;
using protocol::FrameKind;
using test::bytes;
using test::frame;

const std::string kQuery = "02 00 07 0001 00000141 08 9A00000000000000";

bool is_packet(const std::string& digits) { return parse_cannelloni(bytes(digits)).has_value(); }

TEST(Cannelloni, AFrameOfEachKindThereAndBack) {
  const std::array frames{
      frame("141#9A00000000000000"),
      Frame{.id = 0x12345678, .kind = FrameKind::kRemote, .extended = true, .dlc = 3},
      frame("7FF#")};
  const auto packet = bytes("02 00 FF 0003 00000141 08 9A00000000000000 D2345678 03 000007FF 00");
  EXPECT_EQ(cannelloni_packet(frames, 255), packet);
  const auto read = parse_cannelloni(packet);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->sequence, 255);
  EXPECT_EQ(read->frames, std::vector<Frame>(frames.begin(), frames.end()));
}

TEST(Cannelloni, CanFdAndErrorFramesArriveWithoutTheirData) {
  // CAN FD: the length's highest bit, a byte of flags, twelve bytes.
  const auto read = parse_cannelloni(
      bytes("02 00 00 0002 00000141 8C 01 000102030405060708090A0B 20000004 08 0001000000000000"));
  ASSERT_TRUE(read);
  ASSERT_EQ(read->frames.size(), 2U);
  EXPECT_EQ(read->frames[0].kind, FrameKind::kFd);
  EXPECT_EQ(read->frames[1].kind, FrameKind::kError);
  EXPECT_EQ(read->frames[1].id, 4U);
  const std::array error{Frame{.id = 4, .kind = FrameKind::kError, .dlc = 8}};
  EXPECT_EQ(cannelloni_packet(error, 0), bytes("02 00 00 0001 20000004 08 0000000000000000"));
}

TEST(Cannelloni, WhatIsNoPacket) {
  EXPECT_TRUE(is_packet(kQuery));
  EXPECT_TRUE(is_packet(kQuery + "AA"));  // what stands behind is of no account
  EXPECT_TRUE(is_packet("02 00 00 0000"));
  EXPECT_FALSE(is_packet(""));
  EXPECT_FALSE(is_packet("02 00 00 00"));
  EXPECT_FALSE(is_packet("01" + kQuery.substr(2)));                         // another version
  EXPECT_FALSE(is_packet("02 01" + kQuery.substr(5)));                      // another op code
  EXPECT_FALSE(is_packet(kQuery.substr(0, kQuery.size() - 2)));             // a byte short
  EXPECT_FALSE(is_packet("02 00 07 0002" + kQuery.substr(13)));             // a frame short
  EXPECT_FALSE(is_packet("02 00 00 0001 00000141 09 000000000000000000"));  // nine bytes
  EXPECT_FALSE(is_packet("02 00 00 0001 00000800 00"));                     // more than 11 bits
  EXPECT_FALSE(is_packet("02 00 00 0001 00000141 8C"));                     // no flags
  EXPECT_FALSE(is_packet("02 00 00 0001 00000141 C1 00" + std::string(130, '0')));  // 65 bytes
}

TEST(Cannelloni, APacketFitsIntoAnEthernetFrame) {
  const std::vector<Frame> most(kMostCannelloniFrames, frame("141#9A00000000000000"));
  EXPECT_LE(cannelloni_packet(most, 0).size(), 1472U);
  EXPECT_EQ(parse_cannelloni(cannelloni_packet(most, 0))->frames, most);
  auto longer = cannelloni_packet(most, 0);
  longer.resize(kLongestCannelloni + 1);
  EXPECT_FALSE(parse_cannelloni(longer));
}

TEST(PacketsMissed, AreThoseBetweenTwo) {
  PacketsMissed missed;
  EXPECT_EQ(missed.before(200), 0U);  // whatever it begins with
  EXPECT_EQ(missed.before(201), 0U);
  EXPECT_EQ(missed.before(203), 1U);
  EXPECT_EQ(missed.before(202), 0U);  // late
  EXPECT_EQ(missed.before(203), 0U);  // twice
  EXPECT_EQ(missed.before(255), 51U);
  EXPECT_EQ(missed.before(2), 2U);
  EXPECT_EQ(missed.before(90), 87U);
  EXPECT_EQ(missed.before(0), 0U);  // the other end has started anew
  EXPECT_EQ(missed.before(1), 0U);
}

}  // namespace cannelloni_test
}  // namespace lk::emulator
