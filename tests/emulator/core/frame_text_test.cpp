// Frames as in can-utils: cansend's `ID#DATA`, candump's `ID#R`, `ID##…` and error frames.

#include "emulator/core/frame_text.hpp"

#include <gtest/gtest.h>

#include "tests/support/frames.hpp"

namespace lk::emulator {
namespace frame_text_test {

using protocol::Frame;
using protocol::FrameKind;

std::string problem(std::string_view text) {
  const auto result = parse_frame(text);
  const auto* reason = std::get_if<std::string>(&result);
  return reason != nullptr ? *reason : "accepted";
}

Frame parsed(std::string_view text) {
  const auto result = parse_frame(text);
  const auto* good = std::get_if<Frame>(&result);
  EXPECT_NE(good, nullptr) << text;
  return good != nullptr ? *good : Frame{};
}

// ASCII neighbours of the hexadecimal digits are not digits.
TEST(FrameText, OnlyHexadecimalDigitsAreDigits) {
  for (const char c : {'/', ':', '@', 'G', '`', 'g', ' ', '-', 'x'}) {
    const std::string id = std::string("14") + c;
    EXPECT_EQ(problem(id + "#9C"),
              '"' + id + "\" is not an identifier of 3 or 8 hexadecimal digits");
    const std::string byte = std::string("9") + c;
    EXPECT_EQ(problem("141#" + byte), '"' + byte + "\" is not a byte of two hexadecimal digits");
  }
  EXPECT_EQ(parsed("7aF#09afAF"), test::frame("7AF#09AFAF"));
}

TEST(FrameText, BytesOfRs485StandBehindItsName) {
  const Frame packet = parsed("rs485#3E9A0100D9");
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

TEST(FrameText, AnIdentifierHasThreeOrEightDigits) {
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

TEST(FrameText, DotsStandBetweenBytesOnly) {
  EXPECT_EQ(parsed("141#9C.00.01"), test::frame("141#9C0001"));
  EXPECT_EQ(problem("141#.9C"), "\".9\" is not a byte of two hexadecimal digits");
  EXPECT_EQ(problem("141#9.C"), "\"9.\" is not a byte of two hexadecimal digits");
}

TEST(FrameText, ARemoteRequestAsksForSoManyBytes) {
  for (const char* text : {"141#R", "141#r", "141#R0", "141#r8"}) {
    EXPECT_EQ(parsed(text).kind, FrameKind::kRemote) << text;
    EXPECT_EQ(parsed(text).dlc, text[5] == '8' ? 8 : 0) << text;
  }
  EXPECT_EQ(problem("141#R9"), "\"R9\" does not request 0 to 8 bytes");
  EXPECT_EQ(problem("141#Rx"), "\"Rx\" does not request 0 to 8 bytes");
  EXPECT_EQ(problem("141#R000000001"), "\"R000000001\" does not request 0 to 8 bytes");
}

TEST(FrameText, WritesNoMoreThanAFrameHolds) {
  Frame longer = test::frame("141#0102030405060708");
  longer.dlc = 15;  // a possible raw DLC
  EXPECT_EQ(frame_text(longer), "141#0102030405060708");
  longer.dlc = 2;
  EXPECT_EQ(frame_text(longer), "141#0102");
}

}  // namespace frame_text_test
}  // namespace lk::emulator
