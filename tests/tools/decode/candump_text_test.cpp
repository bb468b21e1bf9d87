// Lines of candump as can-utils 2020.11 printed them on a real bus, and their times.

#include "emulator/monitor/frames/candump_text.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/frames.hpp"
#include "tools/decode/summary.hpp"

namespace lk::emulator {
namespace candump_text_test {

using namespace std::chrono_literals;

PrintedFrame shown(std::string_view line) {
  const auto parsed = parse_candump_text(line);
  if (const auto* problem = std::get_if<std::string>(&parsed)) ADD_FAILURE() << line << *problem;
  const auto* frame = std::get_if<PrintedFrame>(&parsed);
  return frame != nullptr ? *frame : PrintedFrame{};
}

TEST(CandumpText, ReadsOutputOfAnyOptions) {
  const protocol::Frame frame = test::frame("142#9C19000003002108");
  for (const char* line :
       {"(1795303966.883131) vcan1 142#9C19000003002108",
        "(1795303972.149581) vcan1 142#9C19000003002108 T",
        "  vcan1  142   [8]  9C 19 00 00 03 00 21 08",
        "  vcan1  TX - -  142   [8]  9C 19 00 00 03 00 21 08",
        " (1795303992.513139)  vcan1  142   [8]  9C 19 00 00 03 00 21 08",
        " (000.041064)  vcan1  142   [8]  9C 19 00 00 03 00 21 08\r",
        " (2026-11-21 23:33:28.889034)  vcan1  142   [8]  9C 19 00 00 03 00 21 08",
        " (000.028241)  vcan1  RX B E  142   [8]  9C 19 00 00 03 00 21 08",
        "  vcan1  142   [8]  9C 19 00 00 03 00 21 08   '......!.'",
        "  vcan1  142   {B}  9C 19 00 00 03 00 21 08",
        "  \x1b[1m\x1b[31mvcan1\x1b[0m  142   [8]  9C 19 00 00 03 00 21 08",
        "  \x1b[1m\x1b[31mvcan1  142   [8]  9C 19 00 00 03 00 21 08\x1b[0m"}) {
    EXPECT_EQ(shown(line).line.frame, frame) << line;
    EXPECT_EQ(shown(line).line.interface, "vcan1") << line;
  }
}

TEST(CandumpText, ReadsStampsAndDirections) {
  EXPECT_EQ(shown(" (1795303992.513139)  a  142   [0] ").line.at, 1'795'303'992s + 513'139us);
  // 2026-11-21 is 20778 days after 1970-01-01.
  EXPECT_EQ(shown(" (2026-11-21 23:33:28.889034)  a  142   [0] ").line.at,
            20778 * 24h + 23h + 33min + 28s + 889'034us);
  EXPECT_FALSE(shown("  a  142   [0] ").has_stamp);
  EXPECT_EQ(shown("  a  RX - -  142   [0] ").line.direction, CandumpLine::Direction::kReceived);
  EXPECT_EQ(shown("  a  TX - -  142   [0] ").line.direction, CandumpLine::Direction::kSent);
  EXPECT_EQ(shown("  a  142   [0] ").line.direction, CandumpLine::Direction::kUnknown);
}

TEST(CandumpText, ReadsEveryKindOfFrame) {
  using protocol::FrameKind;
  EXPECT_EQ(shown("  vcan0  141   [5]  remote request").line.frame.kind, FrameKind::kRemote);
  EXPECT_EQ(shown("  vcan0  141   [5]  remote request").line.frame.dlc, 5);
  EXPECT_EQ(shown("  vcan0  141   [0] ").line.frame.dlc, 0);
  EXPECT_TRUE(shown("  vcan0  1ABCDEF0   [2]  01 02").line.frame.extended);
  EXPECT_EQ(shown("  vcan0       141  [03]  9C 00 01").line.frame.kind, FrameKind::kFd);
  EXPECT_EQ(shown("(1.0) vcan0 141##59C0001").line.frame.kind, FrameKind::kFd);
  const auto error = shown("  can0  20000040   [8]  00 00 00 00 00 00 00 00   ERRORFRAME");
  EXPECT_EQ(error.line.frame.kind, FrameKind::kError);
  EXPECT_EQ(error.line.frame.id, 0x40U);
  // candump -e prints details on further lines.
  EXPECT_TRUE(std::holds_alternative<NoFrame>(parse_candump_text("\tbus-off")));
  EXPECT_TRUE(std::holds_alternative<NoFrame>(parse_candump_text("")));
}

TEST(CandumpText, RejectsOtherTextWithPrintableErrors) {
  const std::string long_line = "(1.0) a 141##0" + std::string(5000, '0');
  for (const std::string& line :
       {std::string("hello"),
        std::string("("),
        std::string("()"),
        std::string("(1.0)"),
        std::string("(1.0) a"),
        std::string("(1.0) a 141"),
        std::string("(1.0) a 141#9"),
        std::string("(2026-13-41 99:99:99.000000)  a  141  [0]"),
        std::string("(2026-11-21 23:33:28.8890"),
        std::string("(99999999999999999999.0) a 141#"),
        std::string("a 141 [9] 00 00 00 00 00 00 00 00 00"),
        std::string("a 141 [8] 00"),
        std::string("a 141 [65]"),
        std::string("a 141 [-1]"),
        std::string("a 141 []"),
        std::string("a 141 ["),
        std::string("a 141 [1] 0"),
        std::string("a 141 [1] 00 00"),
        std::string("a 141 [1] GG"),
        std::string("a 141 [1] 00`00"),
        std::string("a FFF [0]"),
        std::string("a FFFFFFFFF [0]"),
        std::string("a  TX"),
        std::string("TX"),
        std::string(101, 'v') + " 141 [0]",
        std::string("\x1b]0;title\a 141 [0]"),
        std::string("\x1b[2J 141 [0]"),
        std::string("a\0b 141 [0]", 11),
        std::string("a \xC2\x9B 141 [0]"),
        std::string("\xFF\xFE"),
        long_line,
        std::string("DROPCOUNT: dropped 5 CAN frames on 'a' socket (total drops 5)")}) {
    const auto parsed = parse_candump_text(line);
    const auto* problem = std::get_if<std::string>(&parsed);
    ASSERT_NE(problem, nullptr) << line;
    EXPECT_FALSE(problem->empty());
    EXPECT_LE(problem->size(), 200U);
    for (const char c : *problem) EXPECT_TRUE(c >= 0x20 && c <= 0x7E) << *problem;
  }
}

TEST(CandumpText, DetectsStepsByADecreasingStamp) {
  StampReader stamps;
  EXPECT_EQ(stamps.time_of(shown(" (000.000000)  a  141   [0] ")), 0us);
  EXPECT_EQ(stamps.time_of(shown(" (000.000400)  a  141   [0] ")), 400us);
  EXPECT_FALSE(stamps.steps());
  EXPECT_EQ(stamps.time_of(shown(" (000.000300)  a  141   [0] ")), 700us);
  EXPECT_TRUE(stamps.steps());
  EXPECT_EQ(stamps.time_of(shown(" (000.001000)  a  141   [0] ")), 1700us);
  // Interfaces are read in turn, so their times may be out of order.
  StampReader zero_based;
  EXPECT_EQ(zero_based.time_of(shown(" (000.000400)  a  141   [0] ")), 400us);
  EXPECT_EQ(zero_based.time_of(shown(" (000.000300)  b  141   [0] ")), 300us);
  EXPECT_FALSE(zero_based.steps());
}

TEST(LatencyHistogram, ApproximatesQuantiles) {
  LatencyHistogram latency;
  EXPECT_EQ(latency.quantile(0.5), 0us);
  for (int us = 1; us <= 100'000; ++us) latency.add(std::chrono::microseconds(us));
  latency.add(-1us);
  EXPECT_EQ(latency.count(), 100'000U);
  EXPECT_EQ(latency.min(), 1us);
  EXPECT_EQ(latency.max(), 100ms);
  const auto near = [](SimTime is, double should_us) {
    return std::abs(static_cast<double>(is.count()) / 1000 - should_us) <= should_us / 64 + 0.5;
  };
  for (const double share : {0.0001, 0.01, 0.5, 0.9, 0.99, 0.999}) {
    EXPECT_TRUE(near(latency.quantile(share), share * 100'000))
        << share << " " << latency.quantile(share).count();
  }
  EXPECT_EQ(latency.quantile(0), 1us);
  LatencyHistogram one;
  one.add(338'200ns);
  EXPECT_EQ(one.quantile(0.5), 338'200ns);
  one.add(SimTime::max());
  EXPECT_EQ(one.max(), SimTime::max());
}

}  // namespace candump_text_test
}  // namespace lk::emulator
