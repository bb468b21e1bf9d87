#include "emulator/pacer.hpp"

#include <gtest/gtest.h>

namespace lk::emulator {
namespace {

using namespace std::chrono_literals;

constexpr MonoTime kStart = 1'000'000s;

TEST(SimClock, FollowsMonotonicTimeFromTheStart) {
  SimClock clock(kStart);
  EXPECT_EQ(clock.read(kStart, SimTime{0}).now, SimTime{0});
  EXPECT_EQ(clock.read(kStart + 123456ns, SimTime{0}).now, SimTime{123000});
  EXPECT_EQ(clock.to_mono(SimTime{5}), kStart + 1000ns);  // read earlier it would not be there yet
  EXPECT_EQ(clock.slips(), 0U);
}

TEST(SimClock, ALagWithinTheBoundIsCaughtUp) {
  SimClock clock(kStart);
  const auto reading = clock.read(kStart + 1s, SimTime{1s - SimClock::kMostLag});
  EXPECT_EQ(reading.now, SimTime{1s});
  EXPECT_EQ(reading.slipped, SimTime{0});
}

TEST(SimClock, ALongerOneSlips) {
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

TEST(SimClock, ABusAheadOfTheOthersIsNoLag) {
  SimClock clock(kStart);
  // Time slipped for another bus: this one has got further already.
  EXPECT_EQ(clock.read(kStart + 1s, SimTime{2s}).now, SimTime{1s});
  EXPECT_EQ(clock.slips(), 0U);
}

}  // namespace
}  // namespace lk::emulator
