// Durations of trapezoids and ramps, computed by hand (docs/internals/model.md §11).
#include "model/control/motion_loops.hpp"
#include "tests/model/support.hpp"

namespace lk::model::test {
namespace profile_motion_test {

struct Move {
  double duration = 0, fastest = 0, steepest = 0, end = 0, overshoot = 0;
};

/// Returns the reference of a move without a plant: it does not depend on the real angle.
Move reference_move(double distance, double omega_max, double accel) {
  const DriveParams d = ideal_drive();
  ControlSettings settings = unlimited();
  settings.accel_max = accel;
  const MotionParams p = motion_params(d, settings);
  MotionState s = motion_state_at(p, 0.0);
  CurrentOrders<double> orders;
  const Position setpoint{distance, omega_max};
  setpoint_changed(p, Idle{}, setpoint, 0.0, s);
  Move move;
  double omega = 0.0;
  for (int n = 1; n < 2'000'000; ++n) {
    const double before = s.theta_ref;
    const double counts = std::floor(s.theta_ref / p.rad_per_count);  // a shaft that follows
    motion_loops(p, setpoint, counts, 24.0, s, orders);
    const double now = (s.theta_ref - before) / p.T_m;
    move.fastest = std::max(move.fastest, std::abs(now));
    move.steepest = std::max(move.steepest, std::abs(now - omega) / p.T_m);
    move.overshoot =
        std::max(move.overshoot, (s.theta_ref - distance) * (distance > 0 ? 1.0 : -1.0));
    omega = now;
    if (std::abs(s.theta_ref - distance) < 1e-9 && std::abs(now) < 1e-6) {
      move.duration = (n - 1) * p.T_m;
      move.end = s.theta_ref;
      break;
    }
  }
  return move;
}

TEST(Trapezoid, HasItsCalculatedDuration) {
  for (const double distance : {0.01, 0.5, -3.0, 40.0, -400.0}) {
    for (const double omega_max : {5.0, 60.0, 250.0}) {
      for (const double accel : {50.0, 1000.0, 20000.0}) {
        const double way = std::abs(distance);
        const bool triangle = way < omega_max * omega_max / accel;
        const double expected =
            triangle ? 2.0 * std::sqrt(way / accel) : way / omega_max + omega_max / accel;
        const Move move = reference_move(distance, omega_max, accel);
        // Speed changes by a·T_m each 125 µs: the ends and the corner take a few periods. The last
        // step is the remaining distance.
        EXPECT_NEAR(move.duration, expected, 5.0 * 125e-6 + 0.005 * expected)
            << distance << ' ' << omega_max << ' ' << accel;
        EXPECT_LE(move.fastest, omega_max * (1 + 1e-9));
        // Part of a period remains at the end: a·T_m²/8 at most.
        EXPECT_LE(move.overshoot, accel * 125e-6 * 125e-6 / 8.0);
        EXPECT_NEAR(move.end, distance, 1e-9);
        EXPECT_LE(move.steepest, 2.0 * accel * (1 + 1e-6));  // the last step may halve
        if (!triangle) {
          EXPECT_NEAR(move.fastest, omega_max, accel * 125e-6 + 1e-9);
        }
      }
    }
  }
}

TEST(Trapezoid, ShaftFollowsTheReference) {
  DriveParams d = ideal_drive();
  ControlSettings settings = unlimited();
  settings.accel_max = 400.0;
  DriveBank bank = one_drive(d, settings);
  bank.command(0, Position{6.0, 40.0});
  const double expected = 6.0 / 40.0 + 40.0 / 400.0;  // 250 ms
  bank.advance(ticks_in(d, 0.5 * expected));
  EXPECT_NEAR(bank.truth(0).omega_m, 40.0, 4.0);
  EXPECT_NEAR(bank.truth(0).theta_m, 3.0, 0.5);
  bank.advance(ticks_in(d, 0.5 * expected + 0.25));
  EXPECT_NEAR(bank.truth(0).theta_m, 6.0, 1e-3);
  EXPECT_NEAR(bank.truth(0).omega_m, 0.0, 0.2);
}

/// A shaft that follows its reference, so that only the profile moves it.
struct Followed {
  MotionParams p;
  MotionState s = motion_state_at(p, 0.0);
  double steepest = 0;  // rad/s²

  void run(const Setpoint& setpoint, double seconds) {
    CurrentOrders<double> orders;
    for (long n = std::lround(seconds / p.T_m); n > 0; --n) {
      const double before = s.omega_ref;
      const double counts = std::floor(s.theta_ref / p.rad_per_count);
      motion_loops(p, setpoint, counts, 24.0, s, orders);
      steepest = std::max(steepest, std::abs(s.omega_ref - before) / p.T_m);
    }
  }
};

TEST(Trapezoid, SlowsToALowerLimitOnItsRamp) {
  ControlSettings settings = unlimited();
  settings.accel_max = 20.0;
  const MotionParams usual = motion_params(ideal_drive(), settings);
  settings.omega_max = 5.0;
  const MotionParams slow = motion_params(ideal_drive(), settings);
  const Setpoint fast_move = Position{1000.0, 25.0};
  const Setpoint slow_move = Position{1000.0, 5.0};
  const auto check = [](Followed& drive, const Setpoint& then) {
    ASSERT_NEAR(drive.s.omega_ref, 25.0, 1e-6);
    drive.steepest = 0.0;
    drive.run(then, 0.5);  // half of the second that a change of 20 rad/s takes at 20 rad/s²
    EXPECT_NEAR(drive.s.omega_ref, 15.0, 20.0 * drive.p.T_m * 1.01);
    drive.run(then, 0.6);
    EXPECT_NEAR(drive.s.omega_ref, 5.0, 1e-6);
    EXPECT_LE(drive.steepest, 20.0 * (1 + 1e-6));
  };
  {
    SCOPED_TRACE("the next frame allows less");
    Followed drive{usual};
    setpoint_changed(usual, Idle{}, fast_move, 0.0, drive.s);
    drive.run(fast_move, 2.0);
    check(drive, slow_move);
  }
  {
    SCOPED_TRACE("Max Speed allows less");
    Followed drive{usual};
    setpoint_changed(usual, Idle{}, fast_move, 0.0, drive.s);
    drive.run(fast_move, 2.0);
    drive.p = slow;
    check(drive, fast_move);
  }
  {
    SCOPED_TRACE("a move after a speed");
    Followed drive{usual};
    setpoint_changed(usual, Idle{}, Speed{25.0}, 0.0, drive.s);
    drive.run(Speed{25.0}, 2.0);
    setpoint_changed(usual, Speed{25.0}, slow_move, 0.0, drive.s);
    check(drive, slow_move);
  }
}

TEST(SpeedRamp, RisesByTheAcceleration) {
  DriveParams d = ideal_drive();
  ControlSettings settings = unlimited();
  settings.accel_max = 100.0;
  DriveBank bank = one_drive(d, settings);
  bank.command(0, Speed{50.0});
  bank.advance(ticks_in(d, 0.25));
  EXPECT_NEAR(bank.truth(0).omega_ref, 25.0, 100.0 * 125e-6 * 1.01);
  EXPECT_NEAR(bank.truth(0).omega_m, 25.0, 1.5);  // lags by the time constant of the speed loop
  bank.advance(ticks_in(d, 0.75));
  EXPECT_NEAR(bank.truth(0).omega_m, 50.0, 0.5);
}

TEST(Limits, CurrentAndSpeedStayWithinTheirLimits) {
  DriveParams d = ideal_drive();
  d.load.J = 1e-3;
  ControlSettings settings = unlimited();
  settings.i_q_max = 3.0;
  DriveBank bank = one_drive(d, settings);
  bank.command(0, Position{30.0, 20.0});
  double largest_i = 0.0;
  double fastest = 0.0;
  for (int n = 0; n < 4000; ++n) {
    bank.advance(16);
    largest_i = std::max(largest_i, std::abs(bank.truth(0).i_q_ref));
    fastest = std::max(fastest, std::abs(bank.truth(0).omega_ref));
  }
  EXPECT_LE(largest_i, 3.0);
  EXPECT_GE(largest_i, 2.99);
  EXPECT_LE(fastest, 20.0 * (1 + 1e-12));
  bank.advance(ticks_in(d, 3.0));
  EXPECT_NEAR(bank.truth(0).theta_m, 30.0, 0.01);

  // A frame's own current limit counts if it is smaller.
  bank.command(0, Speed{-100.0, 1.0});
  bank.advance(400);
  EXPECT_LE(std::abs(bank.truth(0).i_q_ref), 1.0);
  bank.command(0, Speed{-100.0, 10.0});
  bank.advance(400);
  EXPECT_LE(std::abs(bank.truth(0).i_q_ref), 3.0);
}

}  // namespace profile_motion_test
}  // namespace lk::model::test
