// Single-turn position commands: direction and turn.

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/emulator/core/core_support.hpp"

namespace lk::emulator {
namespace single_turn_test {

using namespace std::chrono_literals;
using test::frame;
using test::Host;
using test::kArrived_cdeg;
using test::kCount_cdeg;
using test::query;
using test::rest_cdeg;
using test::servo_config;

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
           SingleTurnCase{protocol::kClockwise, 4497, 4497},  // within the noise of the target
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

// A host that streams the target must not cause another turn if the shaft overshoots it.
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
  EXPECT_GT(furthest_cdeg, 9000 + 3 * kCount_cdeg);  // otherwise this tests nothing
  EXPECT_LT(furthest_cdeg, 20000);
  EXPECT_NEAR(rest_cdeg(host), 9000, kArrived_cdeg);
}

/// After a stop the direction counts again: clockwise from 45° to 110°, by hand to 200°. The
/// repeated command then moves clockwise to 470°, not back.
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
  host.ask(query(protocol::Position1{9000}));
  host.wait(1s);
  for (const char* text : {"141#A5000000A08C0000", "141#A5020000E8030000", "141#A600E803FFFF0000",
                           "141#A6FFE803E8030000"}) {
    EXPECT_EQ(host.ask(text).data[0], frame(text).data[0]);
  }
  EXPECT_NEAR(rest_cdeg(host), 9000, kArrived_cdeg);
  EXPECT_EQ(host.bus.servo(1).stats.invalid_targets, 4U);
  EXPECT_EQ(host.bus.stats().invalid_targets, 4U);
}

}  // namespace single_turn_test
}  // namespace lk::emulator
