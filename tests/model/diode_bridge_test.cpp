// With the bridge off the diodes reduce the current, and conduct only above the link voltage (§3).
#include "tests/model/support.hpp"

namespace lk::model::test {
namespace diode_bridge_test {

constexpr double kDiode = 0.8;  // V

WindingStep<double> diode_bridge(const LegBridgeInput& in) {
  return leg_bridge(in, open_switches(kDiode)).step;
}

LegBridgeInput at_rest(const Dq<double>& i) {
  return {i, 0.0, 0.0, 24.0, 0.1, 0.14, 0.12e-3, 0.12e-3, 0.00499, 1.0 / 32e3, 0.0};
}

TEST(DiodeBridge, LinkVoltageReducesTheCurrentToZero) {
  // Current into a, out of b: b − a has −(V + 2·v_d), so 2·L·di/dt = −(V + 2·v_d) − 2·R·i.
  LegBridgeInput in = at_rest(park(clarke(Abc<double>{5.0, -5.0, 0.0}), sincos(0.0)));
  const double v = 0.5 * (in.v_link + 2.0 * kDiode);
  for (int n = 1; n <= 8; ++n) {
    in.i = diode_bridge(in).i_next;
    const Abc<double> i = inverse_clarke(inverse_park(in.i, sincos(0.0)));
    const double t = n * in.T_s;
    const double expected =
        std::max(0.0, -v / in.R_s + (5.0 + v / in.R_s) * std::exp(-in.R_s / in.L_d * t));
    // Second order in a sixteenth of a period: (R·h/L)²/6 of the change = 1e-6 of v/R = 91 A; the
    // instant of zero is known to a sixteenth of a period.
    const double tolerance = expected > 0.0 ? 5e-4 : v / in.L_d * in.T_s / 16;
    EXPECT_NEAR(i.a, expected, tolerance) << n;
    EXPECT_NEAR(i.b, -expected, tolerance) << n;
    EXPECT_NEAR(i.c, 0.0, 1e-9) << n;
  }
  EXPECT_EQ(in.i.d, 0.0);
  EXPECT_EQ(in.i.q, 0.0);
  for (int n = 0; n < 1000; ++n) {
    const WindingStep<double> step = diode_bridge(in);
    ASSERT_EQ(step.i_next.d, 0.0);
    ASSERT_EQ(step.i_next.q, 0.0);
    ASSERT_EQ(step.i_link, 0.0);
  }
}

TEST(DiodeBridge, ConductsOnlyAboveTheLineToLineThreshold) {
  // Largest line-to-line back-EMF over a turn: √3·ψ·ω_e.
  const double threshold = (24.0 + 1.6) / (std::sqrt(3.0) * 0.00499);
  for (const double part : {-0.999, -0.5, 0.5, 0.999}) {
    LegBridgeInput in = at_rest({0.0, 0.0});
    in.omega_e = part * threshold;
    for (int n = 0; n < 500; ++n) {
      in.theta_e += in.omega_e * in.T_s;
      const WindingStep<double> step = diode_bridge(in);
      ASSERT_EQ(step.i_next.d, 0.0) << part;
      ASSERT_EQ(step.i_next.q, 0.0) << part;
      in.i = step.i_next;
    }
  }
  for (const double part : {-1.3, 1.05, 1.3}) {
    LegBridgeInput in = at_rest({0.0, 0.0});
    in.omega_e = part * threshold;
    double charge = 0.0;
    double torque_sign = 0.0;
    for (int n = 0; n < 2000; ++n) {
      in.theta_e += in.omega_e * in.T_s;
      const WindingStep<double> step = diode_bridge(in);
      ASSERT_TRUE(std::isfinite(step.i_next.d) && std::isfinite(step.i_next.q));
      // A rectifier only charges the link. An instant of zero is known to a sixteenth of a period.
      // In it a current changes by V/L·T/16 = 0.4 A at most, over a sixteenth of the mean.
      ASSERT_LE(step.i_link, 0.03);
      charge += step.i_link;
      torque_sign += step.i_mean.q * in.omega_e;
      in.i = step.i_next;
    }
    EXPECT_LT(charge, 0.0) << part;
    EXPECT_LT(torque_sign, 0.0) << part;  // braking
  }
}

TEST(DiodeBridge, EnergyBalances) {
  for (const double ratio : {1.0, 2.0}) {
    for (const double part : {0.0, 0.6, 1.5}) {
      LegBridgeInput in = at_rest({1.0, 9.0});
      in.L_q = ratio * in.L_d;
      in.omega_e = part * (24.0 + 1.6) / (std::sqrt(3.0) * 0.00499);
      const auto magnetic = [&] {
        return 0.75 * (in.L_d * in.i.d * in.i.d + in.L_q * in.i.q * in.i.q);
      };
      const double before = magnetic();
      double copper = 0;
      double diodes = 0;
      double link = 0;
      double mechanical = 0;
      double turnover = before;
      for (int n = 0; n < 3000; ++n) {
        const WindingStep<double> s = diode_bridge(in);
        copper += 1.5 * in.R_s * s.mean_square * in.T_s;
        diodes += s.p_inverter * in.T_s;
        link += in.v_link * s.i_link * in.T_s;
        const double power =
            1.5 * in.omega_e * (in.psi_f * s.i_mean.q + (in.L_d - in.L_q) * s.mean_dq);
        mechanical += power * in.T_s;
        turnover += std::abs(power) * in.T_s;
        in.theta_e += in.omega_e * in.T_s;
        in.i = s.i_next;
      }
      // Each commutation's instant is known to a sixteenth of a period: 1 % of the stored or
      // converted energy. (A ledger over a whole run shows far less: the bridge is rarely off.)
      EXPECT_NEAR(link, copper + diodes + mechanical + magnetic() - before, 0.01 * turnover)
          << part << ' ' << ratio;
      EXPECT_GT(diodes, 0.0);
    }
  }
}

TEST(DiodeBridge, DoesNotBrakeBelowTheThreshold) {
  DriveParams d = ideal_drive();
  BarePlant plant(d);
  plant.s.omega = 0.5 * 24.0 / (std::sqrt(3.0) * d.motor.psi_f * d.motor.pole_pairs);
  const double omega = plant.s.omega;
  for (int n = 0; n < 32000; ++n) {
    plant.free_step();
  }
  EXPECT_NEAR(plant.s.omega, omega, omega * 32000 * 2.3e-16);  // one rounding per period
  EXPECT_EQ(plant.copper(), 0.0);
}

TEST(DiodeBridge, BrakesOverspeedAndChargesTheLink) {
  DriveParams d = ideal_drive();
  d.supply.i_regen_max = 0.0;  // a rectifier: the link keeps the motor's energy
  d.supply.C_link = 470e-6;
  BarePlant plant(d);
  const double threshold = (24.0 + 1.6) / (std::sqrt(3.0) * d.motor.psi_f * d.motor.pole_pairs);
  plant.s.omega = 1.5 * threshold;
  const double before = plant.energy();
  for (int n = 0; n < 3200; ++n) {
    plant.free_step();
    ASSERT_TRUE(std::isfinite(plant.s.i_q));
  }
  EXPECT_LT(plant.s.omega, 1.5 * threshold);
  // In the end no line-to-line voltage exceeds the link, diodes included; the margin covers
  // ringing.
  EXPECT_LE(std::sqrt(3.0) * d.motor.psi_f * d.motor.pole_pairs * plant.s.omega,
            plant.s.v_link + 1.6 + 0.1);
  EXPECT_GT(plant.s.v_link, 24.0 * 1.3);
  EXPECT_NEAR(plant.energy() + plant.copper() + plant.inverter() - plant.supplied(), before,
              0.01 * (before));
}

TEST(DiodeBridge, ReducesAPureTorqueCurrent) {
  // At angle 0 the q axis lies between b and c: all of i_q = 5 A flows in at b and out at c.
  const DriveParams d = ideal_drive();
  BarePlant plant(d);
  plant.s.i_q = 5.0;
  plant.free_step();
  const double v = 0.5 * (24.0 + 2.0 * plant.p.v_diode);
  const double R = d.motor.R_s;
  const double i_b = 5.0 * std::sqrt(3.0) / 2.0;
  const double left = -v / R + (i_b + v / R) * std::exp(-R / d.motor.L_q * plant.p.T_s);
  ASSERT_GT(left, 0.0);
  EXPECT_NEAR(plant.s.i_q, left / (std::sqrt(3.0) / 2.0), 0.01);
  EXPECT_NEAR(plant.s.i_d, 0.0, 0.01);
}

}  // namespace diode_bridge_test
}  // namespace lk::model::test
