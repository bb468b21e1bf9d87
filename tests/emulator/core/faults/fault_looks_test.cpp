// When a bus evaluates conditions, and which of several faults then begin.

#include <gtest/gtest.h>

#include "tests/emulator/core/faults/fault_support.hpp"

namespace lk::emulator {
namespace fault_looks_test {

using namespace std::chrono_literals;
using test::answers;
using test::clear;
using test::evidence;
using test::Host;
using State = FaultEvidence::State;

void plan_hang(Host& host, SimTime at, const Condition& when) {
  const Fault hang = test::fault("hang", {}, {.duration = 5ms});
  EXPECT_TRUE(host.bus.plan({at, {kWholeBus, SetFault{hang}}, when}));
}

Condition reaches(const char* signal, Edge edge, double level) {
  return {1, SignalReaches{find_signal(signal), edge, level}};
}

// The frame that completes one count but not the other triggers only one fault.
TEST(FaultConditions, OnTheSameCommandEachCountsForItself) {
  Host host(test::bus_config({1}));
  plan_hang(host, 0ms, {1, CommandSeen{0x9C, 1}});
  plan_hang(host, 0ms, {1, CommandSeen{0x9C, 3}});
  EXPECT_FALSE(answers(host));
  EXPECT_EQ(evidence(host, 0).state, State::kActive);
  EXPECT_EQ(evidence(host, 1).state, State::kArmed);
  host.wait(10ms);
  EXPECT_TRUE(answers(host));
  EXPECT_EQ(evidence(host, 1).state, State::kArmed);
  EXPECT_FALSE(answers(host));
  EXPECT_EQ(evidence(host, 1).began_at, 10ms);
}

// Other conditions are evaluated every millisecond meanwhile.
TEST(FaultConditions, WhatHoldsBeforeItsTimeBeginsAtItsTime) {
  Host host(test::bus_config({1}));
  plan_hang(host, 0ms, reaches("alive", Edge::kBelow, 0));  // never true
  plan_hang(host, 50ms, reaches("alive", Edge::kAbove, 1));
  host.wait(49999us);
  EXPECT_EQ(evidence(host, 1).state, State::kArmed);
  host.wait(10ms);
  EXPECT_EQ(evidence(host, 1).began_at, 50ms);
  EXPECT_FALSE(evidence(host, 0).began_at);
}

// A sample planned for a cleared fault does nothing, or serves a later fault.
TEST(FaultConditions, WhatIsClearedIsLookedAtNoMore) {
  Host host(test::bus_config({1}));
  plan_hang(host, 100ms, reaches("alive", Edge::kAbove, 1));
  plan_hang(host, 50ms, reaches("alive", Edge::kBelow, 0));
  host.wait(60ms);
  clear(host);
  host.wait(60ms);  // after 100 ms
  EXPECT_FALSE(host.bus.next_due());
  plan_hang(host, 150ms, reaches("alive", Edge::kAbove, 1));
  host.wait(40ms);
  EXPECT_EQ(evidence(host, 2).began_at, 150ms);
  for (const std::size_t n : {0U, 1U}) {
    EXPECT_EQ(evidence(host, n).state, State::kCleared);
    EXPECT_FALSE(evidence(host, n).began_at);
  }
  host.wait(100ms);
  EXPECT_FALSE(host.bus.next_due());
}

/// The cost of a sample is bounded, and no fault is omitted.
TEST(ManyFaults, AreLookedAtInTurns) {
  const std::vector<int> ids = {1, 2, 3, 4, 5, 6, 7, 8};
  BusConfig config = test::bus_config({1, 2, 3, 4, 5, 6, 7, 8});
  config.seed = 2;  // with some seeds garbage is correct by chance, once in 16384 samples
  Host host(config);
  constexpr std::size_t kFaults =
      4 * FaultBoard::kMaxSamples / 8;  // four times the limit, on 8 drives
  for (std::size_t n = 0; n < kFaults; ++n) {
    host.bus.apply({kWholeBus, SetFault{test::fault("encoder_garbage", {}, {}, ids)}});
  }
  host.wait(8ms);
  std::uint64_t effects = 0;
  for (std::size_t n = 0; n < kFaults; ++n) {
    EXPECT_NEAR(static_cast<double>(evidence(host, n).effects), 8 + 8 * 7 / 4, 8) << n;
    effects += evidence(host, n).effects;
  }
  EXPECT_EQ(effects, (4 + 7) * FaultBoard::kMaxSamples) << "all at first, then a quarter each time";
}

/// A fault that ends before its turn is evaluated at its end.
TEST(ManyFaults, ShowAtTheirEndWhetherTheirTurnHasComeOrNot) {
  const std::vector<int> ids = {1, 2, 3, 4, 5, 6, 7, 8};
  Host host(test::bus_config({1, 2, 3, 4, 5, 6, 7, 8}));
  constexpr std::size_t kFaults = 4 * FaultBoard::kMaxSamples / 8;
  for (std::size_t n = 0; n < kFaults; ++n) {
    const auto course = test::Course{.duration = 500us};
    host.bus.apply({kWholeBus, SetFault{test::fault("encoder_garbage", {}, course, ids)}});
  }
  host.wait(5ms);
  for (std::size_t n = 0; n < kFaults; ++n) EXPECT_GE(evidence(host, n).effects, 8U) << n;
}

}  // namespace fault_looks_test
}  // namespace lk::emulator
