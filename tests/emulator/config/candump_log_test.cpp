// Logs of candump: lines as can-utils' candump -L prints them (log2asc and canplayer read them
// too).

#include "emulator/config/candump_log.hpp"

#include <gtest/gtest.h>

#include "emulator/core/frame_text.hpp"
#include "tests/emulator/config/config_support.hpp"

namespace lk::emulator {
namespace candump_log_test {

using protocol::FrameKind;
using namespace std::chrono_literals;

CandumpLine parsed(std::string_view line) {
  auto result = parse_candump_line(line);
  if (const auto* problem = std::get_if<std::string>(&result)) ADD_FAILURE() << *problem;
  const auto* good = std::get_if<CandumpLine>(&result);
  return good != nullptr ? *good : CandumpLine{};
}

std::string problem(std::string_view line) {
  const auto result = parse_candump_line(line);
  const auto* reason = std::get_if<std::string>(&result);
  return reason != nullptr ? *reason : "accepted";
}

TEST(CandumpLog, ReadsAQuery) {
  const CandumpLine line = parsed("(1700000000.123456) vcan0 141#9C00000000000000");
  EXPECT_EQ(line.at, 1'700'000'000s + 123'456us);
  EXPECT_EQ(line.interface, "vcan0");
  EXPECT_EQ(line.frame.id, 0x141U);
  EXPECT_EQ(line.frame.kind, FrameKind::kData);
  EXPECT_FALSE(line.frame.extended);
  EXPECT_EQ(line.frame.dlc, 8);
  EXPECT_EQ(line.frame.data[0], 0x9C);
  EXPECT_EQ(line.direction, CandumpLine::Direction::kUnknown);
}

TEST(CandumpLog, ReadsShortFramesAndFractionsOfAnyLength) {
  const CandumpLine line = parsed("(0.5) can1 7FF#a1.02");
  EXPECT_EQ(line.at, 500ms);
  EXPECT_EQ(line.frame.id, 0x7FFU);
  EXPECT_EQ(line.frame.dlc, 2);
  EXPECT_EQ(line.frame.data[0], 0xA1);
  EXPECT_EQ(line.frame.data[1], 0x02);
  EXPECT_EQ(parsed("(1.000000001) can1 7FF#").at, 1s + 1ns);
  EXPECT_EQ(parsed("(1.000000001) can1 7FF#").frame.dlc, 0);
}

TEST(CandumpLog, ReadsTheDirectionOfNewerCandumps) {
  EXPECT_EQ(parsed("(1.0) a 141#9C T").direction, CandumpLine::Direction::kSent);
  EXPECT_EQ(parsed("(1.0) a 141#9C R\r").direction, CandumpLine::Direction::kReceived);
  EXPECT_EQ(problem("(1.0) a 141#9C X"), "\"X\" behind the frame is neither R nor T");
  EXPECT_EQ(problem("(1.0) a 141#9C R R"), "has something after its frame");
}

TEST(CandumpLog, ReadsEveryKindOfFrame) {
  EXPECT_EQ(parsed("(1.0) a 141#R").frame.kind, FrameKind::kRemote);
  EXPECT_EQ(parsed("(1.0) a 141#R8").frame.dlc, 8);
  EXPECT_TRUE(parsed("(1.0) a 00000141#9C").frame.extended);
  EXPECT_EQ(parsed("(1.0) a 141##09C00000000000000000000").frame.kind, FrameKind::kFd);
  // CAN_ERR_FLAG with CAN_ERR_BUSOFF, eight bytes of detail.
  const CandumpLine error = parsed("(1.0) a 20000040#0000000000000000");
  EXPECT_EQ(error.frame.kind, FrameKind::kError);
  EXPECT_EQ(error.frame.id, 0x40U);
  EXPECT_FALSE(error.frame.extended);
  // Eight bytes sent with a DLC of 9.
  EXPECT_EQ(parsed("(1.0) a 141#9C00000000000000_9").frame.dlc, 8);
}

TEST(CandumpLog, RejectsMalformedLines) {
  EXPECT_NE(problem("can0  141   [8]  9C 00").find("is not a time stamp"), std::string::npos);
  EXPECT_NE(problem("(12) a 141#").find("is not a time stamp"), std::string::npos);
  EXPECT_NE(problem("(-1.5) a 141#").find("is not a time stamp"), std::string::npos);
  EXPECT_NE(problem("(1.0123456789) a 141#").find("is not a time stamp"), std::string::npos);
  EXPECT_NE(problem("(9223372036854775807.0) a 141#").find("is not a time stamp"),
            std::string::npos);
  EXPECT_EQ(problem("(1.0) vcan0"), "ends before its frame");
  EXPECT_EQ(problem("(1.0) a 141"), "\"141\" is not a frame; write it like 141#9C00000000000000");
  EXPECT_EQ(problem("(1.0) a 14#9C"), "\"14\" is not an identifier of 3 or 8 hexadecimal digits");
  EXPECT_EQ(problem("(1.0) a 800#9C"),
            "\"800\" is above 7FF; identifiers of 29 bits have 8 digits");
  EXPECT_EQ(problem("(1.0) a 141#9"), "\"9\" is not a byte of two hexadecimal digits");
  EXPECT_EQ(problem("(1.0) a 141#9G"), "\"9G\" is not a byte of two hexadecimal digits");
  EXPECT_EQ(problem("(1.0) a 141#000000000000000000"), "more than 8 bytes of data");
  EXPECT_EQ(problem("(1.0) a 141#R9"), "\"R9\" does not request 0 to 8 bytes");
}

TEST(CandumpLog, ParsesStamps) {
  EXPECT_EQ(parse_candump_stamp("(12.50)"), 12'500ms);
  for (const char* stamp :
       {"(12345)", "(1.50", "1.500)", "(.50)", "(10.)", "(a.50)", "(1x.50)", "(-1.50)", "(1.x00)",
        "(1.5x0)", "(1.-50)", "(+1.50)", "(9223372036854775808.0)"}) {
    EXPECT_EQ(parse_candump_stamp(stamp), std::nullopt) << stamp;
  }
}

TEST(CandumpLog, AcceptsAnyBlanksBetweenWords) {
  const CandumpLine line = parsed(" (1.0)\tvcan0 \t141#9C\tT ");
  EXPECT_EQ(line.at, 1s);
  EXPECT_EQ(line.interface, "vcan0");
  EXPECT_EQ(frame_text(line.frame), "141#9C");
  EXPECT_EQ(line.direction, CandumpLine::Direction::kSent);
}

TEST(CandumpLog, NamesTheLineOfAnError) {
  const auto log = parse_candump_log("(1.0) a 141#9C\n\n(2.0) b 142#9C\r\n", "x.log");
  ASSERT_EQ(log.size(), 2U);
  EXPECT_EQ(log[1].interface, "b");
  EXPECT_EQ(config_error([] { parse_candump_log("(1.0) a 141#9C\n\nrubbish", "x.log"); }),
            "x.log:3: \"rubbish\" is not a time stamp; a line of candump -L is like "
            "(1700000000.123456) vcan0 141#9C00000000000000");
}

TEST(CandumpLog, RoundTrips) {
  for (const std::string line :
       {"(1700000000.123456) vcan0 141#9C00000000000000", "(0000000000.000007) can1 7FF#",
        "(0000000001.500000) a 00000141#A1", "(0000000001.500000) a 141#R",
        "(0000000001.500000) a 20000040#0000000000000000", "(0000000001.500000) a 141##0"}) {
    const CandumpLine read = parsed(line);
    EXPECT_EQ(candump_line(read.at, read.interface, read.frame), line);
  }
  for (const std::string line :
       {"(0000000001.500000) a 141#A1 T", "(0000000001.500000) a 141#A1 R"}) {
    const CandumpLine read = parsed(line);
    EXPECT_EQ(candump_line(read.at, read.interface, read.frame, read.direction), line);
  }
  // A time stamp is truncated, not rounded: no frame seems later than its successor.
  EXPECT_EQ(candump_line(1999ns, "a", parsed("(1.0) a 141#9C").frame),
            "(0000000000.000001) a 141#9C");
}

}  // namespace candump_log_test
}  // namespace lk::emulator
