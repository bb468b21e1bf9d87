// The protocol of Lawicel's adapters, byte for byte by its manual "CAN232". Commands: S, O, L, C,
// t, T, r, R, F, V, N, Z, M, m.

#include "emulator/io/transports/slcan.hpp"

#include <gtest/gtest.h>

#include "tests/support/frames.hpp"

namespace lk::emulator {
namespace slcan_test {

using protocol::Frame;
using protocol::FrameKind;
using test::frame;
using namespace std::chrono_literals;

ParsedInput say(Slcan& slcan, std::string_view line) {
  ParsedInput parsed;
  const auto* const bytes = reinterpret_cast<const std::uint8_t*>(line.data());
  slcan.parse({bytes, line.size()}, 0s, parsed);
  return parsed;
}

std::string shown(Slcan& slcan, const Frame& what, ClientProtocol::Time now = 0s) {
  std::string out;
  slcan.encode(what, now, out);
  return out;
}

TEST(Slcan, RoundTripsEachKindOfFrame) {
  for (const char* line :
       {"t1418A100000064000000", "t7FF0", "T1FFFFFFF2ABCD", "T000001410", "r1418", "R1234567F0"}) {
    const auto parsed = parse_slcan_frame(line);
    ASSERT_TRUE(parsed) << line;
    EXPECT_EQ(slcan_frame(*parsed), line);
  }
  const Frame torque = *parse_slcan_frame("t1418A100000064000000");
  EXPECT_EQ(torque, frame("141#A100000064000000"));
  EXPECT_EQ(parse_slcan_frame("r1418")->kind, FrameKind::kRemote);
  EXPECT_EQ(parse_slcan_frame("R1234567F0")->id, 0x1234567FU);
  EXPECT_TRUE(parse_slcan_frame("T000001410")->extended);
}

TEST(Slcan, RejectsMalformedFrames) {
  for (const char* line :
       {"", "t", "t141", "t1419", "t1418", "t14180", "t8000", "t1410 ", "t14110G", "t141100 ",
        "t1411+1", "T200000000", "T0000014", "r14111", "x1410", "t-410"}) {
    EXPECT_FALSE(parse_slcan_frame(line)) << line;
  }
}

/// python-can 4 does this at start and end. The adapter refuses it; no line is malformed.
TEST(Slcan, RejectsRepeatedOpenAndClose) {
  Slcan slcan(1'000'000);
  const ParsedInput parsed = say(slcan, "C\rS8\rO\rO\rC\r");
  EXPECT_EQ(parsed.response, "\a\r\r\a\r");
  EXPECT_EQ(parsed.malformed, 0U);
  EXPECT_EQ(say(slcan, "Cx\rOx\r").malformed, 2U);
}

/// python-can 4.1 takes some acknowledgements for frames.
TEST(Slcan, AnswersOnlyQueriesWithoutAcknowledgements) {
  Slcan slcan(1'000'000, false);
  const ParsedInput parsed = say(slcan, "C\rS8\rO\rt1410\rT000001410\rt9\r");
  EXPECT_EQ(parsed.response, "");
  EXPECT_EQ(parsed.frames.size(), 2U);
  EXPECT_EQ(parsed.malformed, 1U);  // the line without a frame
  EXPECT_EQ(say(slcan, "V\rv\rN\rF\r").response, "V1013\rv0101\rNLKEM\rF00\r");
  EXPECT_EQ(shown(slcan, frame("141#00")), "t141100\r");
}

TEST(Slcan, PassesNoFramesBeforeOpen) {
  Slcan slcan(1'000'000);
  EXPECT_EQ(say(slcan, "t1410\r").response, "\a");
  EXPECT_EQ(shown(slcan, frame("141#00")), "");
  EXPECT_EQ(say(slcan, "S8\rO\r").response, "\r\r");
  const ParsedInput parsed = say(slcan, "t1410\rT000001410\r");
  EXPECT_EQ(parsed.response, "z\rZ\r");
  EXPECT_EQ(parsed.frames.size(), 2U);
  EXPECT_EQ(shown(slcan, frame("141#00")), "t141100\r");
  EXPECT_EQ(say(slcan, "C\r").response, "\r");
  EXPECT_EQ(shown(slcan, frame("141#00")), "");
}

TEST(Slcan, AcceptsSplitLines) {
  Slcan slcan(0);
  say(slcan, "O\r");
  EXPECT_EQ(say(slcan, "t141").response, "");
  EXPECT_EQ(say(slcan, "19").frames.size(), 0U);
  const ParsedInput parsed = say(slcan, "A\rt1");
  ASSERT_EQ(parsed.frames.size(), 1U);
  EXPECT_EQ(parsed.frames[0], frame("141#9A"));
}

TEST(Slcan, CountsAnOverlongLineOnce) {
  Slcan slcan(0);
  say(slcan, "O\r");
  EXPECT_EQ(say(slcan, std::string(100'000, 't')).response, "");
  const ParsedInput parsed = say(slcan, "\rt1410\r");
  EXPECT_EQ(parsed.response, "\az\r");
  EXPECT_EQ(parsed.malformed, 1U);
}

TEST(Slcan, RejectsFramesInListenMode) {
  Slcan slcan(0);
  EXPECT_EQ(say(slcan, "L\r").response, "\r");
  EXPECT_EQ(say(slcan, "t1410\r").response, "\a");
  EXPECT_EQ(shown(slcan, frame("141#00")), "t141100\r");
}

TEST(Slcan, BlocksFramesAtAnotherBitRate) {
  Slcan slcan(1'000'000);
  const ParsedInput set = say(slcan, "S6\r");
  EXPECT_EQ(set.response, "\r");
  EXPECT_NE(set.warning.find("is at 500000 bit/s and the drives are at 1000000"),
            std::string::npos);
  say(slcan, "O\r");
  const ParsedInput parsed = say(slcan, "t1410\r");
  EXPECT_EQ(parsed.response, "z\r");
  EXPECT_TRUE(parsed.frames.empty());
  EXPECT_EQ(shown(slcan, frame("141#00")), "");
  EXPECT_EQ(say(slcan, "F\r").response, "F80\r");
  Slcan without_wire(0);
  EXPECT_EQ(say(without_wire, "S0\rO\rt1410\r").frames.size(), 1U);
}

TEST(Slcan, KeepsStatusFlagsUntilRead) {
  Slcan slcan(0);
  say(slcan, "O\r");
  slcan.note_loss();
  EXPECT_EQ(say(slcan, "F\rF\r").response, "F08\rF00\r");
  EXPECT_EQ(shown(slcan, {.kind = FrameKind::kError}), "");
  EXPECT_EQ(say(slcan, "F\r").response, "F80\r");
}

TEST(Slcan, WrapsStampsAtOneMinute) {
  Slcan slcan(0);
  EXPECT_EQ(say(slcan, "Z1\rO\r").response, "\r\r");
  EXPECT_EQ(shown(slcan, frame("141#9A"), 59'999ms), "t14119AEA5F\r");
  EXPECT_EQ(shown(slcan, frame("141#9A"), 60'000ms), "t14119A0000\r");
  EXPECT_EQ(say(slcan, "Z0\r").response, "\a");  // only while closed
}

/// SJA1000, two filters: identifier and RTR in the upper 12 bits of each half; a mask bit 1 means
/// don't care.
TEST(Slcan, FiltersIdentifiers) {
  Slcan slcan(0);
  // 0x141 << 5 = 0x2820; 0x142 << 5 = 0x2840; RTR don't care.
  EXPECT_EQ(say(slcan, "M28202840\rm001F001F\rO\r").response, "\r\r\r");
  EXPECT_NE(shown(slcan, frame("141#00")), "");
  EXPECT_NE(shown(slcan, frame("142#00")), "");
  EXPECT_EQ(shown(slcan, frame("143#00")), "");
  EXPECT_EQ(shown(slcan, frame("7FF#00")), "");
  EXPECT_EQ(say(slcan, "M2820284\r").response, "\a");
}

}  // namespace slcan_test
}  // namespace lk::emulator
