#include <gtest/gtest.h>

#include <random>

#include "tests/support/test_bus.hpp"

namespace lk::emulator {
namespace {

using namespace std::chrono_literals;
using test::Host;

/// A drive whose link is empty 0.45 s after its supply is gone, and that boots in 50 ms.
ServoConfig powered_drive(int id = 1) {
  ServoConfig config = test::servo_config(id);
  config.profile.drive.supply.i_logic = 0.04;
  config.profile.drive.logic = {.v_reset = 5.0, .v_reset_hysteresis = 0.5, .boot_time = 0.05};
  return config;
}

BusConfig powered_bus(std::initializer_list<int> ids, std::int64_t bitrate = 0) {
  BusConfig config = test::bus_config(ids, bitrate);
  for (ServoConfig& servo : config.servos) {
    servo = powered_drive(servo.id);
  }
  return config;
}

bool answers(Host& host, int id = 1) {
  protocol::Frame query;
  query.id = 0x140U + static_cast<std::uint32_t>(id);
  query.data[0] = 0x9C;
  return !host.talk(query).empty();
}

TEST(Power, OffIsDeadWhenTheLinkIsEmptyAndOnBootsAnew) {
  Host host(powered_bus({1, 2}));
  host.bus.apply({1, PowerOff{}});
  EXPECT_TRUE(answers(host));  // the link still feeds it
  host.wait(400ms);            // C·24 V/0.04 A·ln(24/5) = 442 ms
  EXPECT_TRUE(answers(host));
  host.wait(80ms);
  EXPECT_FALSE(answers(host));
  EXPECT_TRUE(answers(host, 2));
  EXPECT_EQ(host.bus.stats().count(Drop::kNoPower), 1U);

  host.bus.apply({1, PowerOn{}});
  host.wait(45ms);
  EXPECT_FALSE(answers(host));  // boots
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
  EXPECT_EQ(host.bus.servo(1).run_state(), RunState::kRunning);
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
  host.wait(51ms);                                   // and a while for the link
  EXPECT_NEAR(host.bus.truth(1).v_bus, 14.0, 0.05);
  host.bus.apply({1, SupplyVoltage{24.0, 100ms}});
  host.wait(50ms);
  host.bus.apply({1, SupplyVoltage{12.0, 0ns}});  // the new one replaces the ramp
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
  EXPECT_NEAR(link_V(20ms), 18.0, 0.05);  // not the 24 V it started with

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
  EXPECT_NEAR(link_V(100ms), 16.0, 0.05);  // what was said last counts
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
  EXPECT_FALSE(answers(host, 2));  // was never switched on
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
  EXPECT_EQ(host.bus.stats().count(Drop::kWrongMode), 1U);  // drive 2 is there
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

TEST(Memory, AReplyToAWriteComesWhenTheFlashIsDoneAndNobodyElseWaits) {
  BusConfig config = powered_bus({1, 2});
  config.servos[0].flash.write_time = 5ms;
  Host host(config);
  host.bus.receive({0ns, test::frame("141#32000A0B0C0D0E0F")});
  host.bus.receive({0ns, test::frame("141#9A00000000000000")});
  host.bus.receive({0ns, test::frame("142#9A00000000000000")});
  std::vector<TimedFrame> replies;
  std::vector<RomWrite> writes;
  host.wait(4999us);
  host.bus.take_replies(replies);
  host.bus.take_rom_writes(writes);
  ASSERT_EQ(replies.size(), 1U);
  EXPECT_EQ(replies[0].frame.id, 0x142U);
  EXPECT_TRUE(writes.empty());
  host.wait(1us);
  host.bus.take_replies(replies);
  host.bus.take_rom_writes(writes);
  ASSERT_EQ(replies.size(), 3U);
  EXPECT_EQ(replies[1], (TimedFrame{5ms, test::frame("141#32000A0B0C0D0E0F"), 1}));
  EXPECT_EQ(replies[2].frame.data[0], 0x9A);  // a drive answers in order
  EXPECT_EQ(replies[2].after_rom_write, 0U);
  ASSERT_EQ(writes.size(), 1U);
  EXPECT_EQ(writes[0].number, 1U);
  EXPECT_EQ(writes[0].rom.gains.speed_kp, 0x0C);
  EXPECT_EQ(writes[0].wear[0], 1U);
}

TEST(Memory, AWriteThatThePowerCutShortNeverWas) {
  ServoConfig config = powered_drive();
  config.flash.write_time = 20ms;
  Host host(config);
  host.bus.receive({0ns, test::frame("141#32000A0B0C0D0E0F")});
  host.bus.receive({0ns, test::frame("141#3200010203040506")});
  host.wait(10ms);
  host.bus.apply({1, SupplyVoltage{0.0, 0ns}});
  host.wait(100ms);
  host.bus.apply({1, SupplyVoltage{24.0, 0ns}});
  host.wait(100ms);
  std::vector<RomWrite> writes;
  host.bus.take_rom_writes(writes);
  EXPECT_TRUE(writes.empty());
  EXPECT_EQ(host.ask("141#3000000000000000"), test::frame("141#3000646432283232"));  // factory
  EXPECT_EQ(host.bus.servo(1).wear()[0], 0U);
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
  EXPECT_EQ(host.bus.servo(1).wear()[0], 0U);
  std::vector<RomWrite> writes;
  host.bus.take_rom_writes(writes);
  EXPECT_TRUE(writes.empty());
}

TEST(Power, ARestartOfADeadControllerIsNothing) {
  Host host(powered_drive());
  host.ask("141#3400000068010000");  // acceleration, RAM
  host.bus.apply({1, SupplyVoltage{0.0, 0ns}});
  host.wait(50ms);
  const Registers ram = host.bus.servo(1).ram();
  host.bus.power_cycle(1);
  EXPECT_FALSE(answers(host));
  EXPECT_EQ(host.bus.servo(1).ram(), ram);  // it starts when the power is back
}

TEST(Memory, WornCellsKeepWhatTheyHave) {
  ServoConfig config = powered_drive();
  config.flash = {.write_time = 0ns, .endurance = 2};
  Host host(config);
  host.ask("141#3200010101010101");
  host.ask("141#3200020202020202");
  EXPECT_EQ(host.ask("141#3200030303030303"), test::frame("141#3200030303030303"));
  EXPECT_EQ(host.ask("141#3000000000000000"), test::frame("141#3000030303030303"));  // RAM
  host.ask("141#91000000000000FF");  // another parameter has cells of its own
  host.bus.apply({1, PowerCycle{}});
  host.wait(1s);
  EXPECT_EQ(host.ask("141#3000000000000000"), test::frame("141#3000020202020202"));
  EXPECT_EQ(host.bus.servo(1).wear()[0], 2U);
}

/// A host that writes ROM 15 times as fast as the flash takes it: 5 s of that on two drives.
TEST(Memory, AHostThatWritesFasterThanTheFlashIsNotTakenIn) {
  for (const std::int64_t bitrate : {std::int64_t{0}, std::int64_t{1'000'000}}) {
    BusConfig config = powered_bus({1, 2}, bitrate);
    config.servos[0].flash.write_time = 2ms;
    Host host(config);
    std::vector<RomWrite> writes;
    std::uint64_t busy_before = 0;
    for (int n = 0; n < 37'500; ++n) {
      const SimTime at = n * 133us;
      host.bus.advance_to(at);
      host.bus.receive({at, test::frame("141#32000A0B0C0D0E0F")});
      if (n % 7500 == 0) {
        const BusStats stats = host.bus.stats();
        EXPECT_TRUE(n == 0 || stats.count(Drop::kDriveBusy) > busy_before + 6000);
        busy_before = stats.count(Drop::kDriveBusy);
      }
    }
    host.wait(2ms * CanWire::kDriveQueue + 1ms);  // no more than this had been taken in
    EXPECT_FALSE(host.bus.next_due());
    const BusStats stats = host.bus.stats();
    EXPECT_EQ(stats.frames, stats.queries + stats.count(Drop::kDriveBusy));
    EXPECT_EQ(stats.replies, stats.queries);
    EXPECT_EQ(stats.rom_writes, stats.queries);  // what is not answered is not executed
    EXPECT_NEAR(static_cast<double>(stats.queries), 5.0 / 2e-3, 30.0);
    host.bus.take_rom_writes(writes);
    EXPECT_EQ(writes.size(), stats.queries);
    EXPECT_TRUE(answers(host, 2) || bitrate > 0);
  }
}

TEST(Power, AFrameThatItsDriveCouldNotFinishKeepsTheOthersOffTheWire) {
  BusConfig config = powered_bus({1, 2}, 10'000);  // a frame takes 12 ms
  config.servos[0].reply_time = 0ns;
  config.servos[1].reply_time = 0ns;
  Host host(config);
  host.bus.receive({0ns, test::frame("141#9A00000000000000")});
  host.wait(12ms + 300us);  // the reply is on its way
  host.bus.apply({1, SupplyVoltage{0.0, 0ns}});
  host.bus.receive({13ms, test::frame("142#9A00000000000000")});
  host.wait(27ms);
  std::vector<TimedFrame> replies;
  host.bus.take_replies(replies);
  EXPECT_TRUE(replies.empty());
  EXPECT_EQ(host.bus.stats().replies_lost, 1U);
  host.wait(12ms);
  host.bus.take_replies(replies);
  ASSERT_EQ(replies.size(), 1U);  // behind the query, the spoiled frame and the other query
  EXPECT_GT(replies[0].at, 4 * 11ms);
}

/// Replies of a run with a frame every `pause` that is cut into `slices` at random instants.
std::vector<TimedFrame> sliced_run(unsigned slices, SimTime pause) {
  BusConfig config = powered_bus({1, 2, 3}, 1'000'000);
  config.servos[1].profile.drive.inverter.f_pwm = 20e3;
  config.servos[0].flash.write_time = 3ms;
  config.events = {{20ms, {1, SupplyVoltage{2.0, 7ms}}},   {60ms, {1, SupplyVoltage{24.0, 3ms}}},
                   {90ms, {2, TurnShaft{30.0}}},           {100ms, {2, SupplyVoltage{0.0, 0ns}}},
                   {101ms, {2, SupplyVoltage{24.0, 0ns}}}, {120ms, {3, PowerCycle{100ms}}}};
  Bus bus(config);
  std::mt19937 generator(slices);
  std::uniform_int_distribution<std::int64_t> cut(0, 800'000'000 / slices * 2);
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
  const auto once = sliced_run(1, 400us);
  EXPECT_GT(once.size(), 1000U);
  EXPECT_LT(once.size(), 2000U);  // some of the time somebody is dead
  EXPECT_EQ(once, sliced_run(100, 400us));
  EXPECT_EQ(once, sliced_run(20000, 400us));
}

TEST(Power, ACrowdedRunDoesNotDependOnHowItIsSliced) {
  const auto once = sliced_run(1, 150us);  // more than the wire carries
  EXPECT_GT(once.size(), 2000U);
  EXPECT_EQ(once, sliced_run(100, 150us));
  EXPECT_EQ(once, sliced_run(20000, 150us));
}

}  // namespace
}  // namespace lk::emulator
