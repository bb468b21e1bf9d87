#include <gtest/gtest.h>

#include "emulator/core/bus/bus.hpp"
#include "tests/support/golden_trace.hpp"

namespace lk::emulator {
namespace golden_test {

TEST(Golden, RestingDrive) {
  const test::GoldenTrace trace = test::golden_trace("resting_drive.log");
  ASSERT_GT(trace.expected.size(), 26U);
  Bus bus(test::resting_drive());
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
