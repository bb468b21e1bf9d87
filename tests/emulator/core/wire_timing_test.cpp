#include "emulator/core/wire_timing.hpp"

#include <gtest/gtest.h>

namespace lk::emulator {
namespace wire_timing_test {

using namespace std::chrono_literals;

TEST(WireTiming, BitsTakeTheirTime) {
  EXPECT_EQ(bits_duration(123, 1'000'000), 123us);
  EXPECT_EQ(bits_duration(123, 500'000), 246us);
  EXPECT_EQ(bits_duration(1, 800'000), 1250ns);
  EXPECT_EQ(bits_duration(1, 300'000), 3334ns);  // rounded up: a bit ends completely
  EXPECT_EQ(bits_duration(0, 1'000'000), 0ns);
}

TEST(WireTiming, TicksAreExact) {
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

}  // namespace wire_timing_test
}  // namespace lk::emulator
