// Motion commands at the level of the servo: target, limit, reference. motion_test covers the
// accuracy of a real motor.

#include <gtest/gtest.h>

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
using test::query;
using test::rest_cdeg;
using test::servo_config;

/// Returns the largest speed within the next `duration`, sampled every millisecond.
double top_speed_dps(Host& host, SimTime duration) {
  double top_rad_s = 0;
  for (SimTime t{0}; t < duration; t += 1ms) {
    host.wait(1ms);
    top_rad_s = std::max(top_rad_s, std::abs(host.bus.truth(1).omega_m));
  }
  return top_rad_s * 180 / std::numbers::pi;
}

// --- contents of the reply

TEST(MotionReply, TellsTheStateBeforeTheCommandActs) {
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

TEST(Limits, TorqueCommandIgnoresMaxTorqueCurrent) {
  auto config = servo_config(1);
  config.rom.max_torque_current_lsb = 100;  // 1.6 A
  Host host(config);
  host.ask(query(protocol::Torque{4.8}));
  host.wait(1ms);
  EXPECT_NEAR(host.bus.truth(1).i_q_ref, 4.8, 1e-9);
}

TEST(Limits, SpeedAndPositionRespectMaxTorqueCurrent) {
  auto config = servo_config(1);
  config.rom.max_torque_current_lsb = 100;
  for (const protocol::Command& command :
       {protocol::Command{protocol::Speed{9000}}, protocol::Command{protocol::Position1{360000}}}) {
    Host host(config);
    host.ask(query(command));
    double most_A = 0;
    for (int k = 0; k < 50; ++k) {
      host.wait(1ms);
      most_A = std::max(most_A, std::abs(host.bus.truth(1).i_q_ref));
    }
    EXPECT_NEAR(most_A, 1.6, 1e-9);
  }
}

TEST(Limits, MaxSpeedOfTheSetting) {
  auto config = servo_config(1);
  config.rom.max_speed_dps = 720;
  config.rom.acceleration_dps_s = 7200;  // negligible overshoot
  Host host(config);
  host.ask(query(protocol::Position1{100000}));
  EXPECT_NEAR(top_speed_dps(host, 1s), 720, 72);
  // 0 in the frame means no limit of its own; larger values than the setting have no effect.
  host.ask(query(protocol::Position2{0, 0}));
  EXPECT_NEAR(top_speed_dps(host, 1s), 720, 72);
  host.ask(query(protocol::Position2{9000, 100000}));
  EXPECT_NEAR(top_speed_dps(host, 1s), 720, 72);
  host.wait(2s);
  host.ask(query(protocol::Position2{360, 0}));
  EXPECT_NEAR(top_speed_dps(host, 1s), 360, 36);
}

TEST(Limits, MaxSpeedOfTheFrame) {
  auto config = servo_config(1);
  config.rom.acceleration_dps_s = 7200;
  Host host(config);
  host.ask(query(protocol::Position4{protocol::kClockwise, 500, 4400}));
  EXPECT_NEAR(top_speed_dps(host, 500ms), 500, 50);
  host.wait(2s);
  host.ask(query(protocol::Position6{300, -36000}));
  EXPECT_NEAR(top_speed_dps(host, 500ms), 300, 30);
}

TEST(Limits, MaxAngleHoldsMultiTurnTargets) {
  auto config = servo_config(1);
  config.rom.max_angle_deg = 90;
  Host host(config);
  host.ask(query(protocol::Position1{20000}));
  EXPECT_NEAR(rest_cdeg(host), 9000, kArrived_cdeg);
  host.ask(query(protocol::Position2{0, -20000}));
  EXPECT_NEAR(rest_cdeg(host), -9000, kArrived_cdeg);
  host.ask(
      query(protocol::Position5{-9000}));  // increments and single-turn targets ignore Max Angle
  EXPECT_NEAR(rest_cdeg(host), -18000, kArrived_cdeg);
  host.ask(query(protocol::Position3{protocol::kCounterClockwise, 9000}));
  EXPECT_NEAR(rest_cdeg(host), -27000, kArrived_cdeg);
}

/// Without a ramp the reference jumps to the target. A ramp that is set in motion starts at the
/// shaft: a new target reverses it within its braking distance.
TEST(Limits, AnAccelerationSetUnderWayBeginsWhereTheShaftIs) {
  Host host(servo_config(1));
  host.ask(query(protocol::Position2{500, 3'600'000}));
  host.wait(2s);
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

ServoConfig mounted_the_other_way() {
  ServoConfig config = servo_config(1);
  config.profile.drive.encoder.direction = -1;
  return config;
}

TEST(OtherWayRound, BootsWhereItIsTold) {
  Host host(mounted_the_other_way());
  EXPECT_NEAR(host.single_turn_cdeg(), 4500, kCount_cdeg);
  EXPECT_NEAR(host.bus.truth(1).theta_m, std::numbers::pi / 4, 1e-3);
}

TEST(OtherWayRound, AnglesGrowWithTheSpeed) {
  Host host(mounted_the_other_way());
  host.ask(query(protocol::Speed{360.0}));
  host.wait(1s);
  EXPECT_NEAR(host.state_2().speed_dps, 360, 4);
  EXPECT_NEAR(static_cast<double>(host.multi_turn_cdeg()), 4500 + 36000, 1800);
  EXPECT_GT(host.bus.truth(1).omega_m, 6);
}

TEST(OtherWayRound, ArrivesAndStays) {
  Host host(mounted_the_other_way());
  host.ask(query(protocol::Position1{20000}));
  EXPECT_NEAR(rest_cdeg(host), 20000, kArrived_cdeg);
  host.ask(query(protocol::Position5{0}));
  EXPECT_NEAR(rest_cdeg(host), 20000, kArrived_cdeg);
  host.ask(query(protocol::Position3{protocol::kCounterClockwise, 9000}));
  EXPECT_NEAR(rest_cdeg(host), 9000, kArrived_cdeg);
  host.ask(query(protocol::Position5{-4500}));
  EXPECT_NEAR(rest_cdeg(host), 4500, kArrived_cdeg);
}

// --- multi-turn

TEST(MultiTurn, BothDirections) {
  Host host(servo_config(1));
  host.ask(query(protocol::Position1{100000}));
  EXPECT_NEAR(rest_cdeg(host), 100000, kArrived_cdeg);
  host.ask(query(protocol::Position2{3000, -50000}));
  EXPECT_NEAR(rest_cdeg(host), -50000, kArrived_cdeg);
}

TEST(MultiTurn, CountsFromTheStoredOffset) {
  auto config = servo_config(1);
  config.rom.encoder_offset = 5000;
  Host host(config);
  host.ask(query(protocol::Position1{45000}));
  EXPECT_NEAR(rest_cdeg(host), 45000, kArrived_cdeg);
  EXPECT_NEAR(host.state_2().encoder_counts, 4096, 1);
}

// --- increments

TEST(Increments, CountFromTheLastCommandedPosition) {
  Host host(servo_config(1));
  host.ask(query(protocol::Position1{9000}));
  for (int k = 0; k < 10; ++k) {  // the shaft hardly moves between them
    host.ask(query(protocol::Position5{1000}));
    host.wait(1ms);
  }
  EXPECT_NEAR(rest_cdeg(host), 19000, kArrived_cdeg);
  host.ask(query(protocol::Position6{0, -29000}));
  EXPECT_NEAR(rest_cdeg(host), -10000, kArrived_cdeg);
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
  host.ask(query(protocol::Position5{9000}));
  EXPECT_NEAR(rest_cdeg(host), 9000, kArrived_cdeg);
}

// Without an active position command they count from the shaft's angle.
TEST(Increments, CountFromThePresentPositionOtherwise) {
  auto config = servo_config(1);
  config.quirks.off_needs_run = true;
  Host host(config);
  host.ask(query(protocol::Position5{1000}));  // after power-up
  EXPECT_NEAR(rest_cdeg(host), 5500, kArrived_cdeg);

  host.ask(query(protocol::Position1{50000}));  // after off and run
  host.ask(query(protocol::Off{}));
  host.ask(query(protocol::Run{}));
  host.ask(query(protocol::Position5{1000}));
  EXPECT_NEAR(rest_cdeg(host), 6500, kArrived_cdeg);

  host.ask(query(protocol::Position1{50000}));  // after another mode
  host.ask(query(protocol::Speed{0}));
  host.ask(query(protocol::Position5{1000}));
  EXPECT_NEAR(rest_cdeg(host), 7500, kArrived_cdeg);

  host.ask(query(protocol::Position1{50000}));  // refused commands have no effect
  host.ask(query(protocol::Off{}));
  host.ask(query(protocol::Position1{90000}));
  host.ask(query(protocol::Run{}));
  host.ask(query(protocol::Position5{1000}));
  EXPECT_NEAR(rest_cdeg(host), 8500, kArrived_cdeg);
}

TEST(Increments, StopKeepsTheBase) {
  Host host(servo_config(1));
  host.ask(query(protocol::Position1{9000}));
  host.ask(query(protocol::Stop{}));
  host.ask(query(protocol::Position5{1000}));
  EXPECT_NEAR(rest_cdeg(host), 10000, kArrived_cdeg);
}

// --- clear angle as documented

TEST(ClearAngle, DropsPositionCommandsAndMovesBothZeros) {
  auto config = servo_config(1);
  config.quirks.dialect.clear_angle = protocol::ClearAngleMeaning::kImplemented;
  // Enough friction to stay where it is released.
  config.profile.drive.mechanics.tau_coulomb = config.profile.drive.mechanics.tau_static = 1e-3;
  Host host(config);
  host.ask(query(protocol::Position1{9000}));
  EXPECT_NEAR(rest_cdeg(host), 9000, kArrived_cdeg);
  host.ask(query(protocol::Position1{50000}));
  host.ask(query(protocol::ClearAngle{}));
  EXPECT_NEAR(rest_cdeg(host), 0, kArrived_cdeg);
  host.ask(query(protocol::Position3{protocol::kClockwise, 9000}));
  EXPECT_NEAR(rest_cdeg(host), 9000, kArrived_cdeg);
  host.ask(query(protocol::Position1{-9000}));
  EXPECT_NEAR(rest_cdeg(host), -9000, kArrived_cdeg);
}

TEST(ClearAngle, LeavesSpeedAlone) {
  auto config = servo_config(1);
  config.quirks.dialect.clear_angle = protocol::ClearAngleMeaning::kImplemented;
  Host host(config);
  host.ask(query(protocol::Speed{360}));
  host.wait(500ms);
  host.ask(query(protocol::ClearAngle{}));
  host.wait(1s);
  EXPECT_NEAR(static_cast<double>(host.multi_turn_cdeg()), 36000, 300);
}

TEST(ClearAngle, LetsNothingGoThatIsStopped) {
  auto config = servo_config(1);
  config.quirks.dialect.clear_angle = protocol::ClearAngleMeaning::kImplemented;
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

}  // namespace position_test
}  // namespace lk::emulator
