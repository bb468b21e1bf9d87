#include <gtest/gtest.h>

#include <random>

#include "tests/emulator/core/faults/fault_support.hpp"
#include "tests/support/test_bus.hpp"

namespace lk::emulator {
namespace power_test {

using namespace std::chrono_literals;
using test::Host;
using test::powered_bus;
using test::powered_drive;

TEST(Power, OffIsDeadWhenTheLinkIsEmptyAndOnBootsAnew) {
  Host host(powered_bus({1, 2}));
  host.bus.apply({1, PowerOff{}});
  EXPECT_TRUE(answers(host));  // the link still supplies it
  host.wait(400ms);            // C·24 V/0.04 A·ln(24/5) = 442 ms
  EXPECT_TRUE(answers(host));
  host.wait(80ms);
  EXPECT_FALSE(answers(host));
  EXPECT_TRUE(answers(host, 2));
  EXPECT_EQ(host.bus.stats().count(Drop::kNoPower), 1U);

  host.bus.apply({1, PowerOn{}});
  host.wait(45ms);
  EXPECT_FALSE(answers(host));  // booting
  host.wait(10ms);
  EXPECT_TRUE(answers(host));
}

TEST(Power, CycleForgetsRamTurnsErrorsAndMotionAndKeepsRom) {
  Host host(powered_drive());
  host.ask("141#3400000068010000");  // acceleration 360 dps/s, RAM
  host.ask("141#32000A0B0C0D0E0F");  // gains, ROM
  host.ask("141#A4006801A08C0000");  // to 360.00 degrees at 360 dps
  host.wait(2s);
  EXPECT_NEAR(static_cast<double>(host.multi_turn_cdeg()), 36000.0, 300.0);

  host.bus.apply({1, PowerCycle{}});
  host.wait(1s);
  EXPECT_EQ(host.ask("141#3300000000000000"), test::frame("141#3300000000000000"));
  EXPECT_EQ(host.ask("141#3000000000000000"), test::frame("141#30000A0B0C0D0E0F"));
  EXPECT_NEAR(static_cast<double>(host.multi_turn_cdeg()), 0.0, 300.0);
  EXPECT_EQ(host.run_state(), RunState::kRunning);
  EXPECT_EQ(host.bus.truth(1).i_q_ref, 0.0);  // idle
}

TEST(Power, TheShaftIsFoundWhereItWasTurnedMeanwhile) {
  Host host(powered_drive());
  ASSERT_EQ(host.single_turn_cdeg(), 4500);
  host.bus.apply({1, PowerOff{}});
  host.wait(600ms);
  host.bus.apply({1, TurnShaft{200.0}});
  host.bus.apply({1, PowerOn{}});
  host.wait(60ms);
  EXPECT_NEAR(host.single_turn_cdeg(), 24500, 3);
  EXPECT_NEAR(static_cast<double>(host.multi_turn_cdeg()), 24500.0 - 36000.0, 3.0);
}

TEST(Power, AZeroWrittenWith19IsInForceAfterTheCycle) {
  Host host(powered_drive());
  host.ask("141#1900000000000000");
  EXPECT_EQ(host.single_turn_cdeg(), 4500);
  host.bus.apply({1, PowerCycle{}});
  host.wait(1s);
  EXPECT_NEAR(host.single_turn_cdeg() % 36000, 0, 3);
}

TEST(Power, BrownOutInMidMoveEndsTheMoveAndASagAboveTheThresholdDoesNot) {
  Host host(powered_drive());
  host.ask("141#A200000050460000");  // 180 dps
  host.wait(300ms);
  host.bus.apply({1, SupplyVoltage{9.0, 0ns}});
  host.wait(50ms);
  host.bus.apply({1, SupplyVoltage{24.0, 0ns}});
  host.wait(200ms);
  EXPECT_NEAR(host.state_2().speed_dps, 180.0, 5.0);

  host.bus.apply({1, SupplyVoltage{3.0, 0ns}});
  host.wait(20ms);
  EXPECT_FALSE(answers(host));
  host.bus.apply({1, SupplyVoltage{24.0, 0ns}});
  host.wait(60ms);
  EXPECT_TRUE(answers(host));
  EXPECT_EQ(host.bus.truth(1).omega_ref, 0.0);
  EXPECT_EQ(host.bus.truth(1).i_q_ref, 0.0);
}

TEST(Power, ARampIsEven) {
  Host host(powered_drive());
  host.bus.apply({1, SupplyVoltage{14.0, 100ms}});
  host.wait(50ms);
  EXPECT_NEAR(host.bus.truth(1).v_bus, 19.0, 0.15);  // a step of the ramp is 0.1 V
  host.wait(51ms);                                   // plus time for the link
  EXPECT_NEAR(host.bus.truth(1).v_bus, 14.0, 0.05);
  host.bus.apply({1, SupplyVoltage{24.0, 100ms}});
  host.wait(50ms);
  host.bus.apply({1, SupplyVoltage{12.0, 0ns}});  // replaces the ramp
  host.wait(100ms);
  EXPECT_NEAR(host.bus.truth(1).v_bus, 12.0, 0.05);
}

TEST(Power, ASagEndsAtWhatTheSupplyHadOrWasOnItsWayTo) {
  Host host(powered_drive());
  const auto link_V = [&](SimTime wait) {
    host.wait(wait);
    return host.bus.truth(1).v_bus;
  };
  host.bus.apply({1, SupplyVoltage{18.0}});
  host.bus.apply({1, Sag{10.0, 50ms}});
  EXPECT_NEAR(link_V(49ms), 10.0, 0.05);
  EXPECT_NEAR(link_V(20ms), 18.0, 0.05);  // not the 24 V of the start

  host.bus.apply({1, SupplyVoltage{22.0, 100ms}});
  host.wait(20ms);
  host.bus.apply({1, Sag{12.0, 30ms}});
  EXPECT_NEAR(link_V(29ms), 12.0, 0.05);
  EXPECT_NEAR(link_V(20ms), 22.0, 0.05);

  host.bus.apply({1, Sag{12.0, 50ms}});
  host.wait(10ms);
  host.bus.apply({1, Sag{9.0, 50ms}});
  EXPECT_NEAR(link_V(49ms), 9.0, 0.05);
  EXPECT_NEAR(link_V(20ms), 22.0, 0.05);

  host.bus.apply({1, Sag{12.0, 50ms}});
  host.bus.apply({1, SupplyVoltage{16.0, 10ms}});
  EXPECT_NEAR(link_V(100ms), 16.0, 0.05);  // the last command counts
  EXPECT_FALSE(host.bus.next_due());
}

TEST(Power, EventsOfTheConfigurationHappenAtTheirTimes) {
  BusConfig config = powered_bus({1, 2});
  config.events = {{0ms, {2, PowerOff{}}},
                   {100ms, {1, SupplyVoltage{3.0, 0ns}}},
                   {150ms, {1, SupplyVoltage{24.0, 0ns}}},
                   {300ms, {2, PowerOn{}}}};
  Host host(config);
  EXPECT_TRUE(answers(host));
  EXPECT_FALSE(answers(host, 2));  // never switched on
  host.wait(120ms);
  EXPECT_FALSE(answers(host));
  host.wait(100ms);
  EXPECT_TRUE(answers(host));
  EXPECT_FALSE(answers(host, 2));
  host.wait(140ms);
  EXPECT_TRUE(answers(host, 2));
}

TEST(Power, AFrameForSeveralFindsNobodyWhenAllAreDead) {
  BusConfig config = powered_bus({1, 2});
  config.servos[0].rom.broadcast_mode = true;
  Host host(config);
  host.bus.apply({1, SupplyVoltage{0.0, 0ns}});
  host.wait(50ms);
  EXPECT_TRUE(host.talk(test::frame("280#0000000000000000")).empty());
  EXPECT_EQ(host.bus.stats().count(Drop::kWrongMode), 1U);  // drive 2 has power
  host.bus.apply({2, SupplyVoltage{0.0, 0ns}});
  host.wait(50ms);
  EXPECT_TRUE(host.talk(test::frame("280#0000000000000000")).empty());
  EXPECT_EQ(host.bus.stats().count(Drop::kNoPower), 1U);
}

TEST(Power, WhatADeadDriveWasAboutToSayIsLost) {
  BusConfig config = powered_bus({1}, 1'000'000);
  config.servos[0].reply_time = 100ms;
  Host host(config);
  host.bus.receive({0ns, test::frame("141#9C00000000000000")});
  host.wait(10ms);
  host.bus.apply({1, SupplyVoltage{0.0, 0ns}});
  host.wait(1s);
  EXPECT_EQ(host.bus.stats().replies, 0U);
  EXPECT_EQ(host.bus.stats().replies_lost, 1U);
}

TEST(Power, ARestartOfTheControllerLosesWhatItWasAboutToSayAndToWrite) {
  ServoConfig config = powered_drive();
  config.flash.write_time = 20ms;
  Host host(config);
  host.bus.receive({0ns, test::frame("141#32000A0B0C0D0E0F")});
  host.wait(10ms);
  host.bus.power_cycle(1);
  EXPECT_FALSE(host.bus.next_due());
  EXPECT_EQ(host.bus.stats().replies_lost, 1U);
  EXPECT_EQ(host.ask("141#3000000000000000"), test::frame("141#3000646432283232"));  // factory
  EXPECT_EQ(host.bus.servo(1).wear[0], 0U);
  std::vector<RomWrite> writes;
  host.bus.take_rom_writes(writes);
  EXPECT_TRUE(writes.empty());
}

TEST(Power, ARestartOfADeadControllerIsNothing) {
  Host host(powered_drive());
  host.ask("141#3400000068010000");  // acceleration, RAM
  host.bus.apply({1, SupplyVoltage{0.0, 0ns}});
  host.wait(50ms);
  const Registers ram = host.bus.servo(1).ram;
  host.bus.power_cycle(1);
  EXPECT_FALSE(answers(host));
  EXPECT_EQ(host.bus.servo(1).ram, ram);  // kept until it restarts
}

/// Returns the replies of a run with a frame every `pause`, cut into `slices` at random instants.
std::vector<TimedFrame> sliced_run(unsigned slices, SimTime pause, BusConfig config) {
  config.servos[1].profile.drive.inverter.f_pwm = 20e3;
  config.servos[0].flash.write_time = 3ms;
  const std::vector<TimedDirective> events = {
      {20ms, {1, SupplyVoltage{2.0, 7ms}}},   {60ms, {1, SupplyVoltage{24.0, 3ms}}},
      {90ms, {2, TurnShaft{30.0}}},           {100ms, {2, SupplyVoltage{0.0, 0ns}}},
      {101ms, {2, SupplyVoltage{24.0, 0ns}}}, {120ms, {3, PowerCycle{100ms}}}};
  if (config.events.empty()) config.events = events;
  Bus bus(config);
  std::mt19937 generator(slices);
  std::uniform_int_distribution<std::int64_t> cut(0, std::int64_t{800'000'000} / slices * 2);
  const auto poll = [&](SimTime at, int n) {
    const char* const kinds[] = {"#9C00000000000000", "#A200000050460000", "#32000A0B0C0D0E0F",
                                 "#9200000000000000"};
    bus.receive({at, test::frame("14" + std::to_string(1 + n % 3) + kinds[n / 3 % 4])});
  };
  std::vector<TimedFrame> replies;
  SimTime now{0};
  const int frames = static_cast<int>(800ms / pause);
  for (int n = 0; n < frames; ++n) {
    const SimTime at = n * pause;
    while (now < at) {
      now = std::min(at, now + SimTime{cut(generator)});
      bus.advance_to(now);
    }
    poll(at, n);
  }
  bus.advance_to(900ms);
  bus.take_replies(replies);
  return replies;
}

TEST(Power, TheRunDoesNotDependOnHowItIsSliced) {
  const BusConfig config = powered_bus({1, 2, 3}, 1'000'000);
  const auto once = sliced_run(1, 400us, config);
  EXPECT_GT(once.size(), 1000U);
  EXPECT_LT(once.size(), 2000U);  // some drives are off some of the time
  EXPECT_EQ(once, sliced_run(100, 400us, config));
  EXPECT_EQ(once, sliced_run(20000, 400us, config));
}

// A full wire, and drives that often lose power, mostly while a frame is sent.
TEST(Power, ACrowdedRunDoesNotDependOnHowItIsSliced) {
  BusConfig config = powered_bus({1, 2, 3}, 50'000);
  for (ServoConfig& servo : config.servos) servo.profile.drive.logic.boot_time = 0.001;
  for (int n = 0; n < 150; ++n) {
    config.events.push_back({n * 5ms + n % 7 * 300us, {1 + n % 3, Sag{0.0, 4ms}}});
  }
  const auto once = sliced_run(1, 4ms, config);
  EXPECT_GT(once.size(), 50U);
  EXPECT_LT(once.size(), 180U);
  EXPECT_EQ(once, sliced_run(100, 4ms, config));
  EXPECT_EQ(once, sliced_run(20000, 4ms, config));
}

}  // namespace power_test
}  // namespace lk::emulator
