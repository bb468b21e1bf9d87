// The motion loops do not wind up while they are limited (docs/internals/model.md §11).
#include "tests/model/support.hpp"

namespace lk::model::test {
namespace windup_test {

constexpr std::int64_t kPeriod = 4;  // ticks of the motion loops
constexpr double kPeriod_s = 4.0 / 32e3;

double position_rad(const DriveBank& bank) {
  return static_cast<double>(bank.telemetry(0).encoder_position) * 2.0 * kPiT / (1 << 18);
}

TEST(CurrentRamp, BoundsTheGrowthFromRest) {
  ControlSettings settings = unlimited();
  settings.current_ramp = 25.0;
  DriveBank bank = one_drive(ideal_drive(), settings);
  bank.advance(3200);
  bank.command(0, Speed{100.0, 0.0});
  bool reached = false;
  for (int n = 1; n <= 160; ++n) {
    bank.advance(kPeriod);
    // The reference after n periods is at most that of the envelope, plus one period for the start.
    EXPECT_LE(std::abs(bank.truth(0).i_q_ref), 25.0 * kPeriod_s * (n + 1)) << "period " << n;
    reached = reached || bank.truth(0).i_q_ref > 0.9 * 25.0 * kPeriod_s * n;
  }
  EXPECT_TRUE(reached);  // the ramp was the limit
}

TEST(CurrentRamp, DoesNotDelayBraking) {
  ControlSettings settings = unlimited();
  settings.current_ramp = 25.0;
  DriveBank bank = one_drive(ideal_drive(), settings);
  bank.command(0, Speed{50.0, 0.0});
  bank.advance(64000);
  bank.command(0, Speed{0.0, 0.0});
  bank.advance(2 * kPeriod);
  // Unramped PI: at least half of K_p·50 rad/s; the ramp alone would allow 6 mA.
  const ControlParams& c = ideal_drive().control;
  const double k_p = c.speed_bandwidth * c.J_nominal / k_t(ideal_drive().motor);
  EXPECT_LT(bank.truth(0).i_q_ref, -0.5 * k_p * 50.0);
}

/// A current catches a load that has turned the shaft backwards, and must stay when the shaft is at
/// rest. If it restarted the ramp, it would take two seconds to return.
TEST(CurrentRamp, KeepsTheCurrentReachedByBraking) {
  constexpr double kHolding_A = 2.0;
  DriveParams d = ideal_drive();
  d.load.tau = kHolding_A * k_t(d.motor) * d.mechanics.gear_ratio;
  ControlSettings settings = unlimited();
  settings.current_ramp = 1.0;
  DriveBank bank = one_drive(d, settings);
  bank.advance(1600);
  ASSERT_GT(std::abs(bank.truth(0).omega_m), 5.0);
  bank.command(0, Speed{0.0, 0.0});
  bank.advance(16000);  // half a second: 100 time constants of the speed loop at 200 1/s
  for (int n = 0; n < 1000; ++n) {
    bank.advance(32);
    ASSERT_LT(std::abs(bank.truth(0).omega_m), 0.5) << n << " ms: it slips";
  }
  EXPECT_NEAR(std::abs(bank.truth(0).i_q_ref), kHolding_A, 0.05 * kHolding_A);
}

/// Held 10 mrad short of its target for seconds, then commanded back: it moves at once.
TEST(AngleIntegral, DoesNotGrowWhileTheShaftIsHeld) {
  DriveParams d = ideal_drive();
  d.control.angle_ki_per_byte = 20.0;
  d.load.theta_max = 0.01;
  ControlSettings settings = unlimited();
  settings.i_q_max = 2.0;
  settings.omega_max = 50.0;
  DriveBank bank = one_drive(d, settings);
  bank.command(0, Position{0.02, 0.0});
  for (int second = 0; second < 5; ++second) {
    bank.advance(32000);
    EXPECT_LE(std::abs(bank.truth(0).omega_ref), settings.omega_max);
  }
  ASSERT_NEAR(position_rad(bank), 0.01, 1e-3);
  bank.command(0, Position{0.0, 0.0});
  bank.advance(16000);  // half a second: ten or more time constants of the position loop at 50 1/s
  EXPECT_NEAR(position_rad(bank), 0.0, 1e-3);
}

/// A voltage-mode drive commanded above its supply's speed slows down at once when commanded lower.
TEST(VoltageMode, SpeedLoopDoesNotWindUpAtTheVoltageLimit) {
  DriveParams d = ideal_drive();
  d.motor.R_s = 3.0;
  d.motor.L_d = d.motor.L_q = 1e-3;
  d.control.has_current_loop = false;
  DriveBank bank = one_drive(d, unlimited());
  bank.command(0, Speed{1e3, 0.0});
  bank.advance(std::int64_t{5} * 32000);
  const double fastest = bank.truth(0).omega_m;
  ASSERT_GT(fastest, 50.0);
  ASSERT_LT(fastest, 0.99e3);
  const double wanted = 0.8 * fastest;
  bank.command(0, Speed{wanted, 0.0});
  bank.advance(16000);
  EXPECT_NEAR(bank.truth(0).omega_m, wanted, 0.05 * wanted);
}

}  // namespace windup_test
}  // namespace lk::model::test
