// Golden traces: candump logs ("candump -L -x"), what hosts sent (T) and what has to come back (R).
// The replies were written by hand from docs/protocol.md; `canplayer` replays the files.

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "tests/support/test_bus.hpp"

namespace lk::emulator {
namespace golden_test {

struct Trace {
  std::vector<TimedFrame> sent;
  std::vector<TimedFrame> expected;
};

/// "(0.010000) vcan0 141#9A00000000000000 T"
Trace read_trace(const std::string& name) {
  std::ifstream file(std::string(LKEMU_SOURCE_DIR) + "/tests/golden/" + name);
  EXPECT_TRUE(file) << name;
  Trace trace;
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    char bracket = 0;
    double at_s = 0;
    std::string interface;
    std::string text;
    std::string direction;
    words >> bracket >> at_s >> bracket >> interface >> text >> direction;
    const TimedFrame frame{std::chrono::microseconds(std::llround(at_s * 1e6)), test::frame(text)};
    (direction == "T" ? trace.sent : trace.expected).push_back(frame);
  }
  return trace;
}

// A drive with ID 1 that stands at 45° at 25 °C on 24 V, on a bus without a bit rate, and that 0x80
// switches off until 0x88.
TEST(Golden, RestingDrive) {
  const Trace trace = read_trace("resting_drive.log");
  ASSERT_GT(trace.expected.size(), 26U);
  BusConfig config = test::bus_config({1});
  config.servos[0].quirks.off_needs_run = true;
  Bus bus(config);
  for (const TimedFrame& frame : trace.sent) {
    bus.receive(frame);
  }
  bus.advance_to(std::chrono::seconds(1));
  std::vector<TimedFrame> replies;
  bus.take_replies(replies);
  ASSERT_EQ(replies.size(), trace.expected.size());
  for (std::size_t k = 0; k < replies.size(); ++k) {
    EXPECT_EQ(replies[k].at, trace.expected[k].at);
    EXPECT_EQ(replies[k].frame, trace.expected[k].frame);
  }
}

}  // namespace golden_test
}  // namespace lk::emulator
