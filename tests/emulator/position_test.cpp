// Motion commands as far as they are the servo's business: which target, which limit, which
// reference. How well a real motor follows is motion_test's.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/support/test_bus.hpp"

namespace lk::emulator {
namespace {

using namespace std::chrono_literals;
using test::frame;
using test::Host;
using test::servo_config;

constexpr double kCount_cdeg = 36000.0 / 16384;
// One count from the target, which itself lies up to half a count from one.
constexpr double kArrived_cdeg = 1.5 * kCount_cdeg;

/// Where the shaft stands when the motion has ended, in 0.01°.
double rest_cdeg(Host& host) {
  host.wait(2s);
  return static_cast<double>(host.multi_turn_cdeg());
}

/// Largest speed within the next `duration`, sampled every millisecond.
double top_speed_dps(Host& host, SimTime duration) {
  double top_rad_s = 0;
  for (SimTime t{0}; t < duration; t += 1ms) {
    host.wait(1ms);
    top_rad_s = std::max(top_rad_s, std::abs(host.bus.truth(1).omega_m));
  }
  return top_rad_s * 180 / std::numbers::pi;
}

protocol::Frame query(const protocol::Command& command) {
  return protocol::encode_query(1, command, protocol::kLegacyFormat);
}

// --- what the reply reports
// ------------------------------------------------------------------------

TEST(MotionReply, TellsTheStateBeforeTheCommandActs) {
  Host host(servo_config(1));
  host.wait(10ms);
  const auto first = host.ask(query(protocol::Torque{3.2}));
  EXPECT_EQ(first, frame("141#A1 19 0000 0000 0008"));  // still at rest
  host.wait(20ms);
  const auto second = host.get<protocol::State2>(protocol::Speed{0.0});
  EXPECT_EQ(second.command, protocol::Opcode::kSpeed);
  EXPECT_NEAR(second.iq_A, 3.2, 0.1);
  EXPECT_GT(second.speed_dps, 100);
}

// --- limits
// ----------------------------------------------------------------------------------------

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
  config.rom.acceleration_dps_s = 7200;  // no overshoot to speak of
  Host host(config);
  host.ask(query(protocol::Position1{100000}));
  EXPECT_NEAR(top_speed_dps(host, 1s), 720, 72);
  // 0 in the frame is no limit of its own; more than the setting does not help.
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
      query(protocol::Position5{-9000}));  // increments and single-turn targets know no Max Angle
  EXPECT_NEAR(rest_cdeg(host), -18000, kArrived_cdeg);
  host.ask(query(protocol::Position3{protocol::kCounterClockwise, 9000}));
  EXPECT_NEAR(rest_cdeg(host), -27000, kArrived_cdeg);
}

/// Without a ramp the reference is at the target at once. A ramp that is set under way begins where
/// the shaft is: a new target turns it round within its braking distance.
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
  // v²/2a = 500²/10000 = 25°, twice that for how closely the loops follow.
  EXPECT_LT(most_cdeg, there_cdeg + 5000);
  host.wait(3s);
  EXPECT_NEAR(rest_cdeg(host), 0, kArrived_cdeg);
}

// --- an encoder that is mounted the other way round: nothing of it shows on the wire
// ------------------------------------------------------------------------------------

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
// ------------------------------------------------------------------------------------

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

// --- single-turn
// -----------------------------------------------------------------------------------

struct SingleTurnCase {
  std::uint8_t direction;
  std::uint16_t target_cdeg;
  double rest_cdeg;  // multi-turn, from 45.00°
};

TEST(SingleTurn, GoesTheWayItIsTold) {
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
           SingleTurnCase{protocol::kClockwise, 4497, 4497},  // within the noise of being there
           SingleTurnCase{protocol::kCounterClockwise, 4503, 4503},
       }) {
    Host host(servo_config(1));
    host.ask(query(protocol::Position3{c.direction, c.target_cdeg}));
    EXPECT_NEAR(rest_cdeg(host), c.rest_cdeg, kArrived_cdeg)
        << int{c.direction} << ' ' << c.target_cdeg;
  }
}

TEST(SingleTurn, CountsFromTheEncoderZero) {
  auto config = servo_config(1);
  config.rom.encoder_offset = 5000;
  Host host(config);
  host.ask(query(protocol::Position3{protocol::kClockwise, 18000}));
  host.wait(2s);
  EXPECT_NEAR(host.single_turn_cdeg(), 18000, kArrived_cdeg);
  EXPECT_NEAR(host.state_2().encoder_counts, 8192, 1);
}

// A host that streams the target must not see another turn when the shaft swings past it.
TEST(SingleTurn, RepeatedCommandKeepsItsTurn) {
  auto config = servo_config(1);
  config.rom.gains.speed_kp = 25;  // soft: it overshoots
  Host host(config);
  double furthest_cdeg = 0;
  for (int k = 0; k < 2000; ++k) {
    host.ask(query(protocol::Position4{protocol::kClockwise, 3000, 9000}));
    host.wait(1ms);
    furthest_cdeg = std::max(furthest_cdeg, static_cast<double>(host.multi_turn_cdeg()));
  }
  EXPECT_GT(furthest_cdeg, 9000 + 3 * kCount_cdeg);  // else this tests nothing
  EXPECT_LT(furthest_cdeg, 20000);
  EXPECT_NEAR(rest_cdeg(host), 9000, kArrived_cdeg);
}

/// After a stop the direction counts again: from 45° clockwise to 110°, on by hand to 200°, and the
/// same command travels clockwise to 470°, not back.
TEST(SingleTurn, StoppedDriveTravelsAnew) {
  Host host(servo_config(1));
  const auto clockwise_to_110 = query(protocol::Position3{protocol::kClockwise, 11000});
  host.ask(clockwise_to_110);
  EXPECT_NEAR(rest_cdeg(host), 11000, kArrived_cdeg);
  host.ask(query(protocol::Position1{20000}));
  EXPECT_NEAR(rest_cdeg(host), 20000, kArrived_cdeg);
  host.ask(clockwise_to_110);
  EXPECT_NEAR(rest_cdeg(host), 47000, kArrived_cdeg);
  host.ask("141#8100000000000000");
  model::LoadParams push;
  push.tau = 0.05;  // turns the free shaft clockwise, past the target
  host.bus.set_load(1, push);
  while (host.multi_turn_cdeg() < 50000) {
    host.wait(1ms);
  }
  host.bus.set_load(1, {});
  host.ask(clockwise_to_110);
  EXPECT_GT(rest_cdeg(host), 80000);
  EXPECT_NEAR(host.single_turn_cdeg(), 11000, kArrived_cdeg);
}

/// Where 0x91 takes effect at once, the same single-turn target is another place.
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
  host.ask(query(protocol::Position1{9000}));
  host.wait(1s);
  for (const char* text : {"141#A5000000A08C0000", "141#A5020000E8030000", "141#A600E803FFFF0000",
                           "141#A6FFE803E8030000"}) {
    EXPECT_EQ(host.ask(text).data[0], frame(text).data[0]);
  }
  EXPECT_NEAR(rest_cdeg(host), 9000, kArrived_cdeg);
  EXPECT_EQ(host.bus.servo(1).stats().invalid_targets, 4U);
  EXPECT_EQ(host.bus.stats().invalid_targets, 4U);
}

// --- increments
// ------------------------------------------------------------------------------------

TEST(Increments, CountFromTheLastCommandedPosition) {
  Host host(servo_config(1));
  host.ask(query(protocol::Position1{9000}));
  for (int k = 0; k < 10; ++k) {  // the shaft has hardly moved between them
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

// Where no position command is in force they count from where the shaft is.
TEST(Increments, CountFromThePresentPositionOtherwise) {
  Host host(servo_config(1));
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

  host.ask(query(protocol::Position1{50000}));  // refused commands do not count
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

// --- clear angle, as it is meant
// -------------------------------------------------------------------

TEST(ClearAngle, DropsPositionCommandsAndMovesBothZeros) {
  auto config = servo_config(1);
  config.quirks.dialect.clear_angle = protocol::ClearAngleMeaning::kImplemented;
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
  push.tau = 0.005;  // would turn a free shaft by many turns
  host.bus.set_load(1, push);
  EXPECT_NEAR(rest_cdeg(host), 0, 500);
  EXPECT_EQ(host.run_state(), RunState::kStopped);
}

}  // namespace
}  // namespace lk::emulator
