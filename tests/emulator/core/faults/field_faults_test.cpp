// Faults observed on real robots, as a host observes them.

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <string_view>
#include <tuple>
#include <variant>

#include "tests/emulator/core/faults/fault_support.hpp"
#include "tests/emulator/core/faults/link_support.hpp"

namespace lk::emulator {
namespace field_faults_test {

using test::answers;
using test::clear;
using test::evidence;
using test::Host;
using test::inject;

ServoConfig watched_drive() {
  ServoConfig config = test::servo_config(1);
  config.quirks.dialect.all_error_bits = true;
  config.rom.protections[static_cast<std::size_t>(model::Error::kLostInput)] = {true, 0.1, 0, 0};
  return config;
}

bool is_told_a_speed(const Host& host) {
  return std::holds_alternative<model::Speed>(host.bus.state().setpoint(1));
}

// --- frames

TEST(FieldFaults, ATornReplyHasTheLowByteOfTheOneBefore) {
  constexpr double kCount_deg = 360.0 / 16384;
  Host host(test::servo_config(1));
  host.bus.apply({1, TurnShaft{255 * kCount_deg}});
  host.wait(1ms);
  EXPECT_EQ(host.state_2().encoder_counts, 0x08FF);
  inject(host, "torn_reply", {static_cast<FaultChoice>(2)});
  EXPECT_EQ(host.state_2().encoder_counts, 0x08FF);  // equal replies
  EXPECT_EQ(evidence(host).effects, 0U);
  host.bus.apply({1, TurnShaft{kCount_deg}});
  host.wait(1ms);
  EXPECT_EQ(host.state_2().encoder_counts, 0x09FF);  // 0x0900
  EXPECT_EQ(evidence(host).effects, 1U);
  EXPECT_EQ(host.state_2().encoder_counts, 0x0900);
  host.bus.apply({1, TurnShaft{-kCount_deg}});
  host.wait(1ms);
  EXPECT_EQ(host.state_2().encoder_counts, 0x0800);  // 0x08FF
  // Other replies, and later ones, are not torn.
  host.get<protocol::MultiTurnAngle>(protocol::ReadMultiTurnAngle{});
  EXPECT_EQ(host.state_2().encoder_counts, 0x08FF);
  EXPECT_EQ(evidence(host).effects, 2U);
}

TEST(FieldFaults, RubbishComesAfterEachStartUntilTheFirstAnswer) {
  Rig rig(bus_config({1}));
  rig.wait(1s);
  rig.set(fault("boot_garbage", {1}, {100}));
  EXPECT_TRUE(rig.wait(500ms).empty());  // started long ago
  const SimTime started = rig.bus.time();
  rig.bus.power_cycle(1);
  const auto rubbish = rig.wait(300ms);
  EXPECT_GE(rubbish.size(), 5U);   // 100 ms, at most 20 ms apart
  EXPECT_LE(rubbish.size(), 20U);  // at least 5 ms apart
  SimTime before = started - 5ms;
  std::set<int> lengths;
  for (std::size_t n = 0; n < rubbish.size(); ++n) {
    EXPECT_EQ(rubbish[n].id, 0x141U);
    EXPECT_LE(rubbish[n].dlc, 7);
    lengths.insert(rubbish[n].dlc);
    EXPECT_LE(rig.seen[n].at - started, 100ms);
    if (n > 0) {
      EXPECT_GE(rig.seen[n].at - before, 5ms);
    }
    EXPECT_LE(rig.seen[n].at - before, 25ms);
    before = rig.seen[n].at;
  }
  EXPECT_GT(lengths.size(), 1U);
  EXPECT_EQ(rig.effects(), rubbish.size());
  rig.bus.power_cycle(1);
  rig.wait(1ms);
  EXPECT_EQ(rig.talk(kState2).size(), 1U);
  EXPECT_TRUE(rig.wait(100ms).empty());
  expect_balanced(rig.bus, rig.seen, "rubbish at boot");
}

TEST(FieldFaults, ADriveAtAnotherBitRateDestroysSixteenFramesAndIsDeafAndMute) {
  Rig rig(bus_config({1, 2}, kBitrate));
  rig.set(fault("wrong_bitrate", {2}));
  const auto frames = rig.talk(kAsk, 10ms);
  ASSERT_EQ(frames.size(), 17U);
  for (std::size_t n = 0; n < 16; ++n) EXPECT_EQ(frames[n].kind, FrameKind::kError);
  EXPECT_EQ(frames[16], kAnswer);
  EXPECT_EQ(rig.effects(), 16U);
  EXPECT_TRUE(rig.talk(frame("142#9A00000000000000"), 10ms).empty());
  EXPECT_EQ(rig.effects(), 17U);
  EXPECT_EQ(rig.dropped(Drop::kFault), 1U);
  rig.clear();
  EXPECT_EQ(rig.talk(frame("142#9A00000000000000"), 10ms).size(), 1U);
  expect_balanced(rig.bus, rig.seen, "another bit rate");
}

TEST(FieldFaults, WhereFramesTakeNoTimeAnotherBitRateIsSilenceOnly) {
  Rig rig(bus_config({1, 2}));
  rig.set(fault("wrong_bitrate", {2}));
  EXPECT_EQ(rig.talk(kAsk), std::vector<Frame>{kAnswer});
  EXPECT_TRUE(rig.talk(frame("142#9A00000000000000")).empty());
}

/// Missing resistors, metres, bit/s, and the share of frames: p1 (rate / 1 M)^2 cable / 2 m, p1 =
/// 0.01 with one missing and 0.5 with both.
TEST(FieldFaults, WithoutTerminationFramesAreDestroyedWithTheSquareOfTheRate) {
  using Case = std::tuple<double, double, std::int64_t, double>;
  for (const auto& [missing, cable_m, bitrate, share] :
       {Case{1, 2, 1'000'000, 0.01}, Case{1, 10, 1'000'000, 0.05}, Case{2, 0.2, 1'000'000, 0.05},
        Case{2, 2, 125'000, 0.0078125}}) {
    Rig rig(bus_config({1}, bitrate));
    rig.set(fault("no_termination", {}, {missing, cable_m}));
    for (int n = 0; n < 2000; ++n) rig.talk(kState2, 8ms);
    const auto destroyed = static_cast<double>(rig.effects());
    const double mean = 4000 * share / (1 - share);  // failures before 4000 successes
    EXPECT_NEAR(destroyed, mean, 5 * std::sqrt(mean / (1 - share))) << missing << ' ' << bitrate;
    EXPECT_EQ(rig.bus.stats().replies, 2000U);
    expect_balanced(rig.bus, rig.seen, "no termination");
  }
  Rig rig(bus_config({1}, kBitrate));
  rig.set(fault("no_termination", {}, {2, 4}));  // no frame succeeds
  rig.talk(kState2, 20ms);
  EXPECT_EQ(rig.bus.stats().queries, 0U);
  EXPECT_GE(rig.effects(), 32U);
}

// --- firmware

TEST(FieldFaults, TheReplyTo9BMayShowWhatItClears) {
  for (const bool before : {false, true}) {
    Host host(watched_drive());
    if (before) inject(host, "clear_reply_before");
    host.wait(200ms);  // trips lost input
    EXPECT_EQ(host.ask("141#9B00000000000000").data[7], before ? 0x80 : 0x00);
    EXPECT_EQ(host.ask("141#9A00000000000000").data[7], 0x00);
    EXPECT_EQ(host.ask("141#9B00000000000000").data[7], 0x00);  // no error left
    if (before) {
      EXPECT_EQ(evidence(host).effects, 1U);
    }
  }
}

TEST(FieldFaults, TheFirstMotionCommandAfterATimeOutIsAnsweredAndNotExecuted) {
  Host host(watched_drive());
  inject(host, "first_command_lost");
  host.ask("141#A200000050460000");  // 180 dps: no time-out yet
  EXPECT_TRUE(is_told_a_speed(host));
  host.wait(200ms);
  host.ask("141#A200000050460000");  // refused, so not counted
  host.ask("141#9B00000000000000");
  host.ask("141#8800000000000000");
  EXPECT_EQ(evidence(host).effects, 0U);
  EXPECT_EQ(host.ask("141#A200000050460000").data[0], 0xA2);
  EXPECT_FALSE(is_told_a_speed(host));
  EXPECT_EQ(evidence(host).effects, 1U);
  host.ask("141#A200000050460000");
  EXPECT_TRUE(is_told_a_speed(host));
  EXPECT_EQ(evidence(host).effects, 1U);
}

TEST(FieldFaults, TheFirstMotionCommandMayBeLostAfterOtherThings) {
  const std::vector<std::pair<LostAfter, std::string_view>> cases = {
      {LostAfter::kClear, "141#9B00000000000000"}, {LostAfter::kOff, "141#8000000000000000"}};
  for (const auto& [after, command] : cases) {
    Host host(test::servo_config(1));
    inject(host, "first_command_lost", {after});
    for (const auto& [other, other_command] : cases) {
      host.ask(other_command);
      host.ask("141#A200000050460000");
      EXPECT_EQ(is_told_a_speed(host), other != after);
      host.ask("141#A200000050460000");
      EXPECT_TRUE(is_told_a_speed(host));
    }
  }
  Host host(test::servo_config(1));
  inject(host, "first_command_lost", {LostAfter::kBoot});
  host.bus.power_cycle(1);
  host.ask("141#A200000050460000");
  EXPECT_FALSE(is_told_a_speed(host));
}

TEST(FieldFaults, ADriveThatHoldsTheBusAfterOffIsMuteUntilItStartsAnew) {
  Host host(test::servo_config(1));
  inject(host, "bus_held_after_off");
  EXPECT_TRUE(answers(host));
  host.ask("141#8000000000000000");  // acknowledged by an echo
  EXPECT_FALSE(answers(host));
  EXPECT_EQ(evidence(host).effects, 1U);
  EXPECT_TRUE(host.talk(test::frame("141#A200000050460000")).empty());
  EXPECT_TRUE(is_told_a_speed(host));
  clear(host);
  EXPECT_FALSE(answers(host));
  host.bus.power_cycle(1);
  EXPECT_TRUE(answers(host));
  EXPECT_EQ(host.bus.stats().replies_lost, 3U);
}

TEST(FieldFaults, TheMultiTurnAngleMayStartTurnsOff) {
  for (const double turns : {1.0, -2.0}) {
    Host host(test::servo_config(1));
    inject(host, "encoder_wrap_at_boot", {turns});
    EXPECT_EQ(host.multi_turn_cdeg(), 4500);
    host.bus.power_cycle(1);
    EXPECT_EQ(static_cast<double>(host.multi_turn_cdeg()), 4500 + 36000 * turns);
    EXPECT_EQ(host.single_turn_cdeg(), 4500);
    EXPECT_EQ(evidence(host).effects, 1U);
    clear(host);
    host.bus.power_cycle(1);
    EXPECT_EQ(host.multi_turn_cdeg(), 4500);
  }
}

TEST(FieldFaults, TheMultiTurnAngleMayStartAtZero) {
  Host host(test::servo_config(1));
  inject(host, "multi_turn_zero_at_boot");
  host.bus.power_cycle(1);
  EXPECT_EQ(host.multi_turn_cdeg(), 0);
  EXPECT_EQ(host.single_turn_cdeg(), 4500);
  EXPECT_EQ(evidence(host).effects, 1U);
}

// --- hardware

ServoConfig braked_drive() {
  ServoConfig config = test::servo_config(1);
  config.profile.drive.brake = {.tau = 1, .engage_time = 0.02, .release_time = 0.03};
  config.profile.drive.load.tau = 0.05;
  config.quirks.dialect.brake_command = true;
  return config;
}

TEST(FieldFaults, ALateBrakeFollowsItsCoilAfterTheTime) {
  Host host(braked_drive());
  inject(host, "brake_late", {100});
  host.wait(50ms);
  EXPECT_EQ(evidence(host).effects, 0U);                   // the coil was not switched
  EXPECT_EQ(host.ask("141#8C01000000000000").data[1], 1);  // at once
  host.wait(99ms);
  EXPECT_EQ(host.bus.truth(1).omega_m, 0);
  test::expect_shown(evidence(host), 50ms, 90);
  host.wait(50ms);
  EXPECT_NE(host.bus.truth(1).omega_m, 0);
  const auto effects = evidence(host).effects;
  host.wait(50ms);
  EXPECT_EQ(evidence(host).effects, effects);  // the brake has followed the coil
}

TEST(FieldFaults, ABrakeThatIsNotLateFollowsAtOnce) {
  Host host(braked_drive());
  host.ask("141#8C01000000000000");
  host.wait(50ms);
  EXPECT_NE(host.bus.truth(1).omega_m, 0);
}

/// Torque is proportional to the cosine of the electrical angle between current and rotor.
TEST(FieldFaults, WithoutCalibrationCurrentMakesNoTorqueOrTheWrongOne) {
  const auto speed_after = [](double offset_deg) {
    Host host(test::servo_config(1));
    if (offset_deg != 0) inject(host, "calibration_lost", {offset_deg});
    host.ask("141#A10000000A000000");  // 0.16 A: stays slow
    host.wait(2ms);
    if (offset_deg != 0) {
      EXPECT_GT(evidence(host).effects, 0U);
    }
    EXPECT_GT(host.bus.telemetry(1).i_q, 0.05);  // the drive measures the current
    return host.bus.truth(1).omega_m;
  };
  const double right = speed_after(0);
  EXPECT_GT(right, 0);
  EXPECT_NEAR(speed_after(90) / right, 0, 0.05);
  EXPECT_NEAR(speed_after(180) / right, -1, 0.05);
  EXPECT_NEAR(speed_after(60) / right, 0.5, 0.05);
}

}  // namespace field_faults_test
}  // namespace lk::emulator
