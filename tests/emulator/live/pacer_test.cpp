#include "emulator/io/live/pacer.hpp"

#include <gtest/gtest.h>

namespace lk::emulator {
namespace pacer_test {

using namespace std::chrono_literals;

constexpr MonoTime kStart = 1'000'000s;

TEST(SimClock, FollowsMonotonicTimeFromTheStart) {
  SimClock clock(kStart);
  EXPECT_EQ(clock.read(kStart, SimTime{0}).now, SimTime{0});
  EXPECT_EQ(clock.read(kStart + 123us, SimTime{0}).now, SimTime{123us});
  EXPECT_EQ(clock.to_mono(SimTime{5us}), kStart + 5us);
  EXPECT_EQ(clock.slips(), 0U);
}

TEST(SimClock, CatchesUpASmallLag) {
  SimClock clock(kStart);
  const auto reading = clock.read(kStart + 1s, SimTime{1s - SimClock::kMaxLag});
  EXPECT_EQ(reading.now, SimTime{1s});
  EXPECT_EQ(reading.slipped, SimTime{0});
}

TEST(SimClock, SlipsOnALargeLag) {
  SimClock clock(kStart);
  const auto stopped = clock.read(kStart + 10s, SimTime{1s});
  EXPECT_EQ(stopped.now, SimTime{1s}) << "the simulation goes on where it was";
  EXPECT_EQ(stopped.slipped, SimTime{9s});
  const auto next = clock.read(kStart + 10s + 1ms, SimTime{1s});
  EXPECT_EQ(next.now, SimTime{1s + 1ms});
  EXPECT_EQ(next.slipped, SimTime{0});
  EXPECT_EQ(clock.to_mono(SimTime{1s}), kStart + 10s);
  EXPECT_EQ(clock.slips(), 1U);
  EXPECT_EQ(clock.total_slip(), SimTime{9s});
}

TEST(SimClock, DoesNotSlipForABusAheadOfTheOthers) {
  SimClock clock(kStart);
  // Time slipped for another bus; this one is already ahead.
  EXPECT_EQ(clock.read(kStart + 1s, SimTime{2s}).now, SimTime{1s});
  EXPECT_EQ(clock.slips(), 0U);
}

TEST(SimClock, ShowsWholeMicroseconds) {
  SimClock clock(kStart);
  EXPECT_EQ(clock.read(kStart + 123999ns, SimTime{0}).now, SimTime{123us});
  // A waiter that wakes at an instant finds that it has come.
  const MonoTime wake = clock.to_mono(SimTime{123456});
  EXPECT_GE(clock.read(wake, SimTime{0}).now, SimTime{123456});
  EXPECT_LT(clock.read(wake - 1us, SimTime{0}).now, SimTime{123456});
}

TEST(SimClock, ScalesTime) {
  SimClock fast(kStart, {.factor = 10});
  EXPECT_EQ(fast.read(kStart + 3ms, SimTime{0}).now, SimTime{30ms});
  EXPECT_EQ(fast.to_mono(SimTime{30ms}), kStart + 3ms);
  EXPECT_EQ(fast.span(2ms), SimTime{20ms});
  SimClock slow(kStart, {.factor = 0.5});
  EXPECT_EQ(slow.read(kStart + 3ms, SimTime{0}).now, SimTime{1500us});
  EXPECT_EQ(slow.to_mono(SimTime{1500us}), kStart + 3ms);
}

TEST(SimClock, MeasuresMaxLagInWallTime) {
  SimClock fast(kStart, {.factor = 10});
  EXPECT_EQ(fast.read(kStart + 50ms, SimTime{0}).now, SimTime{500ms});
  EXPECT_EQ(fast.slips(), 0U);
  const auto reading = fast.read(kStart + 51ms, SimTime{0});
  EXPECT_EQ(reading.now, SimTime{0});
  EXPECT_EQ(reading.slipped, SimTime{510ms});
  EXPECT_EQ(fast.read(kStart + 52ms, SimTime{0}).now, SimTime{10ms});
}

TEST(SimClock, AdvancesOnlyByStepsWhenStepped) {
  SimClock clock(kStart, {.stepped = true});
  EXPECT_EQ(clock.read(kStart + 100s, SimTime{0}).now, SimTime{0});
  EXPECT_EQ(clock.slips(), 0U);
  clock.step_to(7ms);
  EXPECT_EQ(clock.read(kStart + 200s, SimTime{0}).now, SimTime{7ms});
  EXPECT_EQ(clock.span(1s), SimTime{0});
}

TEST(SimClock, SwitchesModeWithoutAJump) {
  SimClock clock(kStart);
  clock.switch_to({.factor = 10}, kStart + 2s, 2s);
  EXPECT_EQ(clock.read(kStart + 2s, 2s).now, SimTime{2s});
  EXPECT_EQ(clock.read(kStart + 2s + 1ms, 2s).now, SimTime{2s + 10ms});
  clock.switch_to({.stepped = true}, kStart + 2s + 1ms, 2s + 10ms);
  EXPECT_EQ(clock.read(kStart + 9s, 2s).now, SimTime{2s + 10ms});
  clock.switch_to({}, kStart + 9s, 2s + 10ms);
  EXPECT_EQ(clock.read(kStart + 9s + 1ms, 2s + 10ms).now, SimTime{2s + 11ms});
}

TEST(ClockMode, ParsesWords) {
  EXPECT_EQ(parse_clock_mode("realtime"), ClockMode{});
  EXPECT_EQ(parse_clock_mode("x1"), ClockMode{});
  EXPECT_EQ(parse_clock_mode("stepped"), ClockMode{.stepped = true});
  EXPECT_EQ(parse_clock_mode("x0.001"), ClockMode{.factor = 0.001});
  EXPECT_EQ(parse_clock_mode("x1000"), ClockMode{.factor = 1000});
  for (const char* wrong :
       {"", "x", "10", "x0", "x-1", "x1001", "x0.0001", "xnan", "x10 ", "x1e400", "Realtime"}) {
    EXPECT_FALSE(parse_clock_mode(wrong)) << wrong;
  }
  for (const char* word : {"realtime", "stepped", "x10", "x0.1"}) {
    EXPECT_EQ(to_string(*parse_clock_mode(word)), word);
  }
}

// --- stamps of frames

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

}  // namespace pacer_test
}  // namespace lk::emulator
