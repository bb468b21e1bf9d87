#include <gtest/gtest.h>

#include "emulator/io/live/pacer.hpp"

namespace lk::emulator {
namespace stamp_clock_test {

using namespace std::chrono_literals;

constexpr auto kAhead = std::chrono::nanoseconds(1'700'000'000s);  // wall clock minus mono

/// Both clocks of a machine, advanced by the test.
struct Machine {
  MonoTime mono = 10s;
  std::chrono::nanoseconds ahead = kAhead;
  int readings = 0;

  std::chrono::nanoseconds stamp() const { return mono + ahead; }
  StampClock clock() {
    return StampClock([this] {
      ++readings;
      return StampClock::Reading{mono + ahead, mono};
    });
  }
};

TEST(StampClock, ReadsTheClocksOnceAndThenTheStamps) {
  Machine machine;
  StampClock clock = machine.clock();
  EXPECT_EQ(clock.reached(machine.stamp(), 10s), 10s);
  for (MonoTime seen = 10s; machine.mono < 10s + 900ms; machine.mono += 1ms) {
    seen = clock.reached(machine.stamp(), seen);
    EXPECT_EQ(seen, machine.mono);
  }
  EXPECT_EQ(machine.readings, 1);
}

TEST(StampClock, ComparesTheClocksAgainAfterAWhile) {
  Machine machine;
  StampClock clock = machine.clock();
  MonoTime seen = 10s;
  for (; machine.mono <= 10s + StampClock::kHolds; machine.mono += 1ms) {
    seen = clock.reached(machine.stamp(), seen);
  }
  EXPECT_EQ(machine.readings, 2);
}

TEST(StampClock, KeepsTheArrivalTimeOfADelayedFrame) {
  Machine machine;
  StampClock clock = machine.clock();
  const auto stamp = machine.stamp();
  machine.mono += 300ms;  // the process stood still
  const MonoTime now = clock.reached(stamp, 10s);
  EXPECT_EQ(now, 10s + 300ms);
  EXPECT_EQ(clock.arrival(stamp, now), 10s);
}

TEST(StampClock, IsMonotonic) {
  Machine machine;
  StampClock clock = machine.clock();
  clock.reached(machine.stamp(), 10s);
  EXPECT_EQ(clock.reached(machine.stamp(), 10s + 1ms), 10s + 1ms) << "seen is later than the stamp";
}

class WallClockSet : public testing::TestWithParam<std::chrono::nanoseconds> {};

TEST_P(WallClockSet, LeavesMonotonicTimeUnchanged) {
  Machine machine;
  StampClock clock = machine.clock();
  MonoTime seen = clock.reached(machine.stamp(), 10s);
  const auto before = machine.stamp();
  machine.ahead += GetParam();
  machine.mono += 1ms;
  seen = clock.reached(machine.stamp(), seen);
  EXPECT_EQ(seen, machine.mono);
  EXPECT_EQ(clock.arrival(machine.stamp(), seen), machine.mono);
  EXPECT_LE(clock.arrival(before, seen), seen) << "stamped before it was set";
  EXPECT_GE(clock.arrival(before, seen), seen - StampClock::kOldest);
}

INSTANTIATE_TEST_SUITE_P(Steps, WallClockSet,
                         testing::Values(-3600s, -2s, -20ms, 20ms, 500ms, 86400s));

TEST(StampClock, CorrectsASmallWallClockStepWithinASecond) {
  Machine machine;
  StampClock clock = machine.clock();
  MonoTime seen = clock.reached(machine.stamp(), 10s);
  machine.ahead += 1ms;
  for (int ms = 0; ms < 1010; ++ms) {
    machine.mono += 1ms;
    seen = clock.reached(machine.stamp(), seen);
    EXPECT_LE(seen, machine.mono + 1ms);
  }
  EXPECT_EQ(seen, machine.mono);
}

TEST(StampClock, ReadsTheWallClockFirst) {
  const MonoTime before = monotonic_now();
  const StampClock::Reading reading = StampClock::read_clocks();
  EXPECT_GE(reading.mono, before);
  EXPECT_LE(reading.mono, monotonic_now());
}

}  // namespace stamp_clock_test
}  // namespace lk::emulator
