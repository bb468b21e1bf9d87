// Motion commands at the level of the servo: target, limit, direction, turn. motion_test covers the
// accuracy of a real motor.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/emulator/core/core_support.hpp"

namespace lk::emulator {
namespace position_test {

using namespace std::chrono_literals;
using test::frame;
using test::Host;
using test::kArrived_cdeg;
using test::kCount_cdeg;
using test::most_A;
using test::query;
using test::rest_cdeg;
using test::send;
using test::servo_config;

/// Sends a motion command and checks the angle at which the shaft comes to rest.
void expect_rest(Host& host, const protocol::Command& command, double expected_cdeg) {
  host.ask(query(command));
  EXPECT_NEAR(rest_cdeg(host), expected_cdeg, kArrived_cdeg);
}

/// Sends a motion command; returns the largest speed within `duration`, sampled every millisecond.
double top_speed_dps(Host& host, const protocol::Command& command, SimTime duration) {
  host.ask(query(command));
  double top_rad_s = 0;
  for (SimTime t{0}; t < duration; t += 1ms) {
    host.wait(1ms);
    top_rad_s = std::max(top_rad_s, std::abs(host.bus.truth(1).omega_m));
  }
  return top_rad_s * 180 / std::numbers::pi;
}

// --- contents of the reply

TEST(MotionReply, ContainsTheStateBeforeTheCommand) {
  Host host(servo_config(1));
  host.wait(10ms);
  const auto first = host.ask(query(protocol::Torque{3.2}));
  EXPECT_EQ(first, frame("141#A1 19 0000 0000 0008"));  // still at rest
  host.wait(20ms);
  const auto second = host.get<protocol::State2>(protocol::Speed{0.0});
  EXPECT_EQ(second.command, protocol::Speed::kOpcode);
  EXPECT_NEAR(second.iq_A, 3.2, 0.1);
  EXPECT_GT(second.speed_dps, 100);
}

// --- limits

TEST(Limits, MaxTorqueCurrentLimitsSpeedAndPositionOnly) {
  auto config = servo_config(1);
  config.rom.max_torque_current_lsb = 100;  // 1.6 A
  using Limited = std::pair<protocol::Command, double>;
  for (const auto& [command, expected_A] :
       {Limited{protocol::Speed{9000}, 1.6}, Limited{protocol::Position1{360000}, 1.6},
        Limited{protocol::Torque{4.8}, 4.8}}) {
    Host host(config);
    host.ask(query(command));
    EXPECT_NEAR(most_A(host, 50ms), expected_A, 1e-9);
  }
}

TEST(Limits, MaxSpeedSettingLimitsPositionCommands) {
  auto config = servo_config(1);
  config.rom.max_speed_dps = 720;
  config.rom.acceleration_dps_s = 7200;  // negligible overshoot
  Host host(config);
  EXPECT_NEAR(top_speed_dps(host, protocol::Position1{100000}, 1s), 720, 72);
  // 0 in the frame means no limit of its own; larger values than the setting have no effect.
  EXPECT_NEAR(top_speed_dps(host, protocol::Position2{0, 0}, 1s), 720, 72);
  EXPECT_NEAR(top_speed_dps(host, protocol::Position2{9000, 100000}, 1s), 720, 72);
  host.wait(2s);
  EXPECT_NEAR(top_speed_dps(host, protocol::Position2{360, 0}, 1s), 360, 36);
}

TEST(Limits, MaxSpeedOfTheFrameLimitsPositionCommands) {
  auto config = servo_config(1);
  config.rom.acceleration_dps_s = 7200;
  Host host(config);
  EXPECT_NEAR(top_speed_dps(host, protocol::Position4{protocol::kClockwise, 500, 4400}, 500ms), 500,
              50);
  host.wait(2s);
  EXPECT_NEAR(top_speed_dps(host, protocol::Position6{300, -36000}, 500ms), 300, 30);
}

TEST(Limits, MaxAngleLimitsMultiTurnTargets) {
  auto config = servo_config(1);
  config.rom.max_angle_deg = 90;
  Host host(config);
  expect_rest(host, protocol::Position1{20000}, 9000);
  expect_rest(host, protocol::Position2{0, -20000}, -9000);
  // Increments and single-turn targets ignore Max Angle.
  expect_rest(host, protocol::Position5{-9000}, -18000);
  expect_rest(host, protocol::Position3{protocol::kCounterClockwise, 9000}, -27000);
}

/// Without a ramp the reference jumps to the target. A ramp that is set in motion starts at the
/// shaft: a new target reverses it within its braking distance.
TEST(Limits, NewAccelerationStartsAtTheShaft) {
  Host host(servo_config(1));
  send(host, query(protocol::Position2{500, 3'600'000}), 2s);
  const auto there_cdeg = static_cast<double>(host.multi_turn_cdeg());
  ASSERT_GT(there_cdeg, 80'000);
  host.ask(query(protocol::WriteAccelerationToRam{5000}));
  host.ask(query(protocol::Position2{500, 0}));
  double most_cdeg = 0;
  for (int k = 0; k < 100; ++k) {
    host.wait(5ms);
    most_cdeg = std::max(most_cdeg, static_cast<double>(host.multi_turn_cdeg()));
  }
  // v²/2a = 500²/10000 = 25°, doubled for the tracking error of the loops.
  EXPECT_LT(most_cdeg, there_cdeg + 5000);
  host.wait(3s);
  EXPECT_NEAR(rest_cdeg(host), 0, kArrived_cdeg);
}

// --- an encoder mounted in the opposite direction, without effect on the wire

ServoConfig reversed_encoder() {
  ServoConfig config = servo_config(1);
  config.profile.drive.encoder.direction = -1;
  return config;
}

TEST(ReversedEncoder, HasNoEffectOnBootAngleAndSpeed) {
  Host host(reversed_encoder());
  EXPECT_NEAR(host.single_turn_cdeg(), 4500, kCount_cdeg);
  EXPECT_NEAR(host.bus.truth(1).theta_m, std::numbers::pi / 4, 1e-3);
  send(host, query(protocol::Speed{360.0}), 1s);
  EXPECT_NEAR(host.state_2().speed_dps, 360, 4);
  EXPECT_NEAR(static_cast<double>(host.multi_turn_cdeg()), 4500 + 36000, 1800);
  EXPECT_GT(host.bus.truth(1).omega_m, 6);
}

TEST(ReversedEncoder, HasNoEffectOnTargets) {
  Host host(reversed_encoder());
  expect_rest(host, protocol::Position1{20000}, 20000);
  expect_rest(host, protocol::Position5{0}, 20000);
  expect_rest(host, protocol::Position3{protocol::kCounterClockwise, 9000}, 9000);
  expect_rest(host, protocol::Position5{-4500}, 4500);
}

// --- multi-turn

TEST(MultiTurn, ReachesTargetsInBothDirections) {
  Host host(servo_config(1));
  expect_rest(host, protocol::Position1{100000}, 100000);
  expect_rest(host, protocol::Position2{3000, -50000}, -50000);
}

// --- increments

TEST(Increments, CountFromTheLastCommandedPosition) {
  Host host(servo_config(1));
  host.ask(query(protocol::Position1{9000}));
  for (int k = 0; k < 10; ++k) {  // the shaft hardly moves between them
    send(host, query(protocol::Position5{1000}), 1ms);
  }
  EXPECT_NEAR(rest_cdeg(host), 19000, kArrived_cdeg);
  expect_rest(host, protocol::Position6{0, -29000}, -10000);
}

TEST(Increments, AddUpWithoutRounding) {
  Host host(servo_config(1));
  host.ask(query(protocol::Position1{0}));
  for (int k = 0; k < 9000; ++k) {
    host.ask(query(protocol::Position5{1}));  // each is half a count
  }
  EXPECT_NEAR(rest_cdeg(host), 9000, kArrived_cdeg);
}

TEST(Increments, CountFromASingleTurnTarget) {
  Host host(servo_config(1));
  host.ask(query(protocol::Position3{protocol::kCounterClockwise, 0}));
  expect_rest(host, protocol::Position5{9000}, 9000);
}

// Without an active position command they count from the shaft's angle.
TEST(Increments, CountFromTheShaftWithoutAPositionCommand) {
  auto config = servo_config(1);
  config.quirks.off_needs_run = true;
  Host host(config);
  expect_rest(host, protocol::Position5{1000}, 5500);

  host.ask(query(protocol::Position1{50000}));  // after off and run
  host.ask(query(protocol::Off{}));
  host.ask(query(protocol::Run{}));
  expect_rest(host, protocol::Position5{1000}, 6500);

  host.ask(query(protocol::Position1{50000}));  // after another mode
  host.ask(query(protocol::Speed{0}));
  expect_rest(host, protocol::Position5{1000}, 7500);

  host.ask(query(protocol::Position1{50000}));  // refused commands have no effect
  host.ask(query(protocol::Off{}));
  host.ask(query(protocol::Position1{90000}));
  host.ask(query(protocol::Run{}));
  expect_rest(host, protocol::Position5{1000}, 8500);
}

TEST(Increments, StopKeepsTheBase) {
  Host host(servo_config(1));
  host.ask(query(protocol::Position1{9000}));
  host.ask(query(protocol::Stop{}));
  expect_rest(host, protocol::Position5{1000}, 10000);
}

// --- clear angle as documented

ServoConfig clears_angle() {
  ServoConfig config = servo_config(1);
  config.quirks.dialect.clear_angle = protocol::ClearAngleMeaning::kImplemented;
  return config;
}

TEST(ClearAngle, DropsPositionCommandsAndMovesBothZeros) {
  auto config = clears_angle();
  // Enough friction to stay where it is released.
  config.profile.drive.mechanics.tau_coulomb = config.profile.drive.mechanics.tau_static = 1e-3;
  Host host(config);
  expect_rest(host, protocol::Position1{9000}, 9000);
  host.ask(query(protocol::Position1{50000}));
  expect_rest(host, protocol::ClearAngle{}, 0);
  expect_rest(host, protocol::Position3{protocol::kClockwise, 9000}, 9000);
  expect_rest(host, protocol::Position1{-9000}, -9000);
}

TEST(ClearAngle, KeepsASpeedCommand) {
  Host host(clears_angle());
  send(host, query(protocol::Speed{360}), 500ms);
  send(host, query(protocol::ClearAngle{}), 1s);
  EXPECT_NEAR(static_cast<double>(host.multi_turn_cdeg()), 36000, 300);
}

TEST(ClearAngle, HoldsAStoppedShaft) {
  auto config = clears_angle();
  config.quirks.stop_holds = true;
  Host host(config);
  host.ask(query(protocol::Position1{9000}));
  rest_cdeg(host);
  host.ask(query(protocol::Stop{}));
  host.ask(query(protocol::ClearAngle{}));
  model::LoadParams push;
  push.tau = 0.005;  // would turn a free shaft many times
  host.bus.set_load(1, push);
  EXPECT_NEAR(rest_cdeg(host), 0, 500);
  EXPECT_EQ(host.run_state(), RunState::kStopped);
}

struct SingleTurnCase {
  std::uint8_t direction;
  std::uint16_t target_cdeg;
  double rest_cdeg;  // multi-turn, from 45.00°
};

TEST(SingleTurn, TurnsInTheCommandedDirection) {
  for (const auto& c : {
           SingleTurnCase{protocol::kClockwise, 9000, 9000},
           SingleTurnCase{protocol::kCounterClockwise, 9000, 9000 - 36000},
           SingleTurnCase{protocol::kClockwise, 0, 36000},
           SingleTurnCase{protocol::kCounterClockwise, 0, 0},
           SingleTurnCase{protocol::kClockwise, 35999, 35999},
           SingleTurnCase{protocol::kCounterClockwise, 35999, -1},
           SingleTurnCase{protocol::kClockwise, 4400, 40400},
           SingleTurnCase{protocol::kCounterClockwise, 4600, 4600 - 36000},
           SingleTurnCase{protocol::kClockwise, 4500, 4500},  // already there
           SingleTurnCase{protocol::kCounterClockwise, 4500, 4500},
           SingleTurnCase{protocol::kClockwise, 4497, 4497},  // within the noise of the target
           SingleTurnCase{protocol::kCounterClockwise, 4503, 4503},
       }) {
    Host host(servo_config(1));
    host.ask(query(protocol::Position3{c.direction, c.target_cdeg}));
    EXPECT_NEAR(rest_cdeg(host), c.rest_cdeg, kArrived_cdeg)
        << int{c.direction} << ' ' << c.target_cdeg;
  }
}

TEST(Position, CountsFromTheStoredOffset) {
  auto config = servo_config(1);
  config.rom.encoder_offset = 5000;
  Host host(config);
  send(host, query(protocol::Position3{protocol::kClockwise, 18000}), 2s);
  EXPECT_NEAR(host.single_turn_cdeg(), 18000, kArrived_cdeg);
  EXPECT_NEAR(host.state_2().encoder_counts, 8192, 1);
  expect_rest(host, protocol::Position1{45000}, 45000);
  EXPECT_NEAR(host.state_2().encoder_counts, 4096, 1);
}

// A host that streams the target must not cause another turn if the shaft overshoots it.
TEST(SingleTurn, RepeatedCommandKeepsItsTurn) {
  auto config = servo_config(1);
  config.rom.gains.speed_kp = 25;  // soft: it overshoots
  Host host(config);
  double furthest_cdeg = 0;
  for (int k = 0; k < 2000; ++k) {
    send(host, query(protocol::Position4{protocol::kClockwise, 3000, 9000}), 1ms);
    furthest_cdeg = std::max(furthest_cdeg, static_cast<double>(host.multi_turn_cdeg()));
  }
  EXPECT_GT(furthest_cdeg, 9000 + 3 * kCount_cdeg);  // otherwise this tests nothing
  EXPECT_LT(furthest_cdeg, 20000);
  EXPECT_NEAR(rest_cdeg(host), 9000, kArrived_cdeg);
}

/// After a stop the direction counts again: clockwise from 45° to 110°, by hand to 200°. The
/// repeated command then moves clockwise to 470°, not back.
TEST(SingleTurn, DirectionCountsAgainAfterAStop) {
  Host host(servo_config(1));
  const auto clockwise_to_110 = query(protocol::Position3{protocol::kClockwise, 11000});
  host.ask(clockwise_to_110);
  EXPECT_NEAR(rest_cdeg(host), 11000, kArrived_cdeg);
  expect_rest(host, protocol::Position1{20000}, 20000);
  host.ask(clockwise_to_110);
  EXPECT_NEAR(rest_cdeg(host), 47000, kArrived_cdeg);
  host.ask("141#8100000000000000");
  model::LoadParams push;
  push.tau = 0.05;  // turns the free shaft clockwise, past the target
  host.bus.set_load(1, push);
  while (host.multi_turn_cdeg() < 50000) host.wait(1ms);
  host.bus.set_load(1, {});
  host.ask(clockwise_to_110);
  EXPECT_GT(rest_cdeg(host), 80000);
  EXPECT_NEAR(host.single_turn_cdeg(), 11000, kArrived_cdeg);
}

/// If 0x91 takes effect at once, a given single-turn target is at another angle.
TEST(SingleTurn, NewOffsetMovesTheTarget) {
  Host host(servo_config(1));
  const auto clockwise_to_100 = query(protocol::Position3{protocol::kClockwise, 10000});
  host.ask(clockwise_to_100);
  rest_cdeg(host);
  host.ask("141#9100000000000010");  // 4096 counts: 90°
  EXPECT_NEAR(host.single_turn_cdeg(), 1000, kArrived_cdeg);
  host.ask(clockwise_to_100);
  rest_cdeg(host);
  EXPECT_NEAR(host.single_turn_cdeg(), 10000, kArrived_cdeg);
}

TEST(SingleTurn, InvalidTargetsAreAnsweredAndCounted) {
  Host host(servo_config(1));
  send(host, query(protocol::Position1{9000}), 1s);
  for (const char* text : {"141#A5000000A08C0000", "141#A5020000E8030000", "141#A600E803FFFF0000",
                           "141#A6FFE803E8030000"}) {
    EXPECT_EQ(host.ask(text).data[0], frame(text).data[0]);
  }
  EXPECT_NEAR(rest_cdeg(host), 9000, kArrived_cdeg);
  EXPECT_EQ(host.bus.servo(1).stats.invalid_targets, 4U);
  EXPECT_EQ(host.bus.stats().invalid_targets, 4U);
}

}  // namespace position_test
}  // namespace lk::emulator
