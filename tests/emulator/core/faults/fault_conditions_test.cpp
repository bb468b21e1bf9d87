// When a bus evaluates conditions, and which of several faults then begin.

#include <gtest/gtest.h>

#include <functional>
#include <numbers>

#include "tests/emulator/core/faults/fault_support.hpp"

namespace lk::emulator {
namespace fault_conditions_test {

using State = FaultEvidence::State;
using namespace std::chrono_literals;
using test::answers;
using test::clear;
using test::evidence;
using test::Host;

void plan_hang(Host& host, SimTime at, const Condition& when) {
  const Fault hang = test::fault("hang", {}, {.duration = 5ms});
  EXPECT_TRUE(host.bus.plan({at, {kWholeBus, SetFault{hang}}, when}));
}

Condition reaches(const char* signal, Edge edge, double level) {
  return {1, SignalReaches{find_signal(signal), edge, level}};
}

TEST(FaultConditions, FrameThatCompletesTheCountIsAffected) {
  Host host(test::bus_config({1, 2}));
  host.ask("141#9C00000000000000");  // before the condition was set
  plan_hang(host, 10ms, {1, CommandSeen{0x9C, 3}});
  EXPECT_TRUE(answers(host));  // before at_s
  host.wait(10ms);
  EXPECT_TRUE(answers(host));
  host.ask("141#9A00000000000000");  // another command
  EXPECT_TRUE(answers(host, 2));     // another drive
  host.wait(1ms);
  EXPECT_TRUE(answers(host));
  host.wait(1ms);
  EXPECT_EQ(evidence(host).state, State::kArmed);
  EXPECT_FALSE(answers(host));
  EXPECT_EQ(evidence(host).began_at, 12ms);
  EXPECT_EQ(evidence(host).first_effect_at, 12ms);
  host.wait(5ms);
  EXPECT_TRUE(answers(host));
  for (int n = 0; n < 10; ++n) EXPECT_TRUE(answers(host));  // only once
}

TEST(FaultConditions, AngleIsCrossedInEitherDirection) {
  Host host(test::bus_config({1}));  // stands at 45 degrees
  const auto crossing = [&] { plan_hang(host, 0ms, reaches("angle_deg", Edge::kCrosses, 50)); };
  const auto turn = [&](double turn_deg) {
    host.bus.apply({1, TurnShaft{turn_deg}});
    host.wait(10ms);
  };
  crossing();
  turn(4);
  EXPECT_FALSE(evidence(host, 0).began_at);
  turn(4);
  EXPECT_EQ(evidence(host, 0).began_at, 11ms);
  crossing();
  turn(4);
  EXPECT_FALSE(evidence(host, 1).began_at);
  turn(-20);
  EXPECT_EQ(evidence(host, 1).began_at, 31ms);
}

/// Expects the start at the first whole millisecond at which `holds`, and only then.
void expect_begins_when(Host& host, const Condition& when, const std::function<bool()>& holds) {
  plan_hang(host, 0ms, when);
  SimTime first{0};
  for (int ms = 0; ms < 5000 && first == 0ms; ++ms) {
    EXPECT_FALSE(evidence(host).began_at);
    host.wait(1ms);
    if (holds()) first = host.bus.time();
  }
  ASSERT_GT(first, 1ms);
  EXPECT_EQ(evidence(host).began_at, first);
}

TEST(FaultConditions, SpeedIsReached) {
  Host host(test::bus_config({1}));
  host.ask("141#A200000050460000");  // 180 dps
  expect_begins_when(host, reaches("speed_dps", Edge::kAbove, 90),
                     [&] { return host.bus.telemetry(1).omega >= 90 * std::numbers::pi / 180; });
}

TEST(FaultConditions, TemperatureIsReached) {
  ServoConfig config = test::servo_config(1);
  model::ThermalParams& thermal = config.profile.drive.thermal;
  thermal.C_winding = thermal.C_housing = 0.1;  // follows the ambient temperature
  Host host(config);
  host.bus.apply({1, AmbientTemperature{0}});
  expect_begins_when(host, reaches("temperature_C", Edge::kBelow, 10),
                     [&] { return host.bus.telemetry(1).temp_motor <= 10; });
}

TEST(FaultConditions, ErrorBitIsSet) {
  ServoConfig config = test::servo_config(1);
  config.rom.protections[0] = {true, 18.0, 1.0, 0.01};
  Host host(config);
  host.bus.apply({1, SupplyVoltage{12.0}});
  expect_begins_when(host, {1, ErrorSet{model::Error::kUnderVoltage}},
                     [&] { return host.bus.telemetry(1).errors != 0; });
}

TEST(FaultConditions, DelayOtherDirectives) {
  Host host(test::bus_config({1, 2}));
  ASSERT_TRUE(host.bus.plan({0ms, {2, TurnShaft{10}}, Condition{1, CommandSeen{0x9C, 2}}}));
  answers(host);
  host.wait(5ms);
  EXPECT_EQ(host.single_turn_cdeg(2), 4500);
  answers(host);
  host.wait(1ms);
  EXPECT_NEAR(host.single_turn_cdeg(2), 5500, 3);
  EXPECT_FALSE(host.bus.next_due());
}

TEST(FaultConditions, BeyondTheLimitAreRefused) {
  Host host(test::bus_config({1}));
  const Condition seen{1, CommandSeen{0x9C, 1}};
  const TimedDirective turn{0ms, {1, TurnShaft{10}}, seen};
  EXPECT_TRUE(host.bus.plan(turn));
  for (std::size_t n = 1; n < Bus::kMaxWaiting; ++n) {
    EXPECT_TRUE(host.bus.plan({0ms, {1, AmbientTemperature{25}}, seen}));
  }
  EXPECT_FALSE(host.bus.plan(turn));
  answers(host);
  EXPECT_TRUE(host.bus.plan(turn));  // space is free again
  host.wait(1ms);
  EXPECT_NEAR(host.single_turn_cdeg(), 5500, 3);
}

// The frame that completes one count but not the other triggers only one fault.
TEST(FaultConditions, EachFaultCountsCommandsSeparately) {
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
TEST(FaultConditions, TrueBeforeTheirTimeBeginAtTheirTime) {
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
TEST(FaultConditions, AreNotSampledOnceCleared) {
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

constexpr std::size_t kFaults = 4 * FaultBoard::kMaxSamples / 8;  // four times the limit

/// Eight drives with `kFaults` faults each.
Host with_many_faults(test::Course course) {
  const std::vector<int> ids = {1, 2, 3, 4, 5, 6, 7, 8};
  BusConfig config = test::bus_config({1, 2, 3, 4, 5, 6, 7, 8});
  config.seed = 2;  // with some seeds garbage is correct by chance, once in 16384 samples
  Host host(config);
  for (std::size_t n = 0; n < kFaults; ++n) {
    test::inject(host, "encoder_garbage", {}, course, ids);
  }
  return host;
}

/// The cost of a sample is bounded, and no fault is omitted.
TEST(ManyFaults, AreSampledInTurns) {
  Host host = with_many_faults({});
  host.wait(8ms);
  std::uint64_t effects = 0;
  for (std::size_t n = 0; n < kFaults; ++n) {
    EXPECT_NEAR(static_cast<double>(evidence(host, n).effects), 8 + 8 * 7 / 4, 8) << n;
    effects += evidence(host, n).effects;
  }
  EXPECT_EQ(effects, (4 + 7) * FaultBoard::kMaxSamples) << "all at first, then a quarter each time";
}

/// A fault that ends before its turn is evaluated at its end.
TEST(ManyFaults, AreSampledAtTheirEnd) {
  Host host = with_many_faults({.duration = 500us});
  host.wait(5ms);
  for (std::size_t n = 0; n < kFaults; ++n) EXPECT_GE(evidence(host, n).effects, 8U) << n;
}

}  // namespace fault_conditions_test
}  // namespace lk::emulator
