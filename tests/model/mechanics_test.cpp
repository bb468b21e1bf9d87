// Rotor and friction against closed forms (docs/internals/model.md §4).
#include "model/plant/stored_energy.hpp"
#include "tests/model/support.hpp"
#include "tests/support/sweep.hpp"

namespace lk::model::test {
namespace mechanics_test {

DriveParams with_friction(double tau_coulomb) {
  DriveParams d = ideal_drive();
  d.mechanics.tau_coulomb = d.mechanics.tau_static = tau_coulomb;
  return d;
}

TEST(Mechanics, ConstantTorqueGivesConstantAcceleration) {
  const DriveParams d = with_friction(0.02);
  Shafts shafts(d);
  shafts.run(0.5, 0.1);
  const double acceleration = (0.1 - 0.02) / d.mechanics.J;
  EXPECT_NEAR(shafts.m.omega, acceleration * 0.5,
              1e-9 * acceleration);  // linear: exact except for rounding
  EXPECT_NEAR(shafts.m.theta, 0.5 * acceleration * 0.25, 1e-9 * acceleration);
  EXPECT_NEAR(shafts.friction, 0.02 * shafts.m.theta, 1e-9);
}

TEST(Mechanics, TorqueIsKtTimesTheCurrent) {
  // The whole plant: holds 4 A with the voltage for R, L and the back-EMF.
  const DriveParams d = with_friction(0.02);
  BarePlant plant(d);
  plant.s.i_q = 4.0;
  const double T = plant.p.T_s;
  for (int n = 0; n < 3200; ++n) {
    // The speed in the middle of the period, as in the plant.
    const double w = d.motor.pole_pairs * (plant.s.omega + 0.5 * plant.s.omega_change);
    plant.step_dq({-w * d.motor.L_q * 4.0, d.motor.R_s * 4.0 + w * d.motor.psi_f});
  }
  const double expected = (k_t(d.motor) * 4.0 - 0.02) / d.mechanics.J * 3200 * T;
  // The duties use the link at the period's start and the first period's speed: 1e-4.
  EXPECT_NEAR(plant.s.omega, expected, 2e-3 * expected);
  EXPECT_NEAR(plant.s.i_q, 4.0, 0.02);
}

TEST(Mechanics, CoulombFrictionStopsACoastingRotor) {
  const DriveParams d = with_friction(0.01);
  Shafts shafts(d);
  shafts.m.omega = 100.0;
  const double expected = d.mechanics.J * 100.0 / 0.01;  // s
  int n = 0;
  while (shafts.m.omega != 0.0 && n < 1'000'000) {
    shafts.step(0.0);
    ++n;
  }
  EXPECT_NEAR(n * shafts.p.T_s, expected, 1.01 * shafts.p.T_s);  // stops at the end of a period
  EXPECT_NEAR(shafts.m.theta, 0.5 * 100.0 * expected, 100.0 * shafts.p.T_s);
  EXPECT_NEAR(shafts.friction, 0.5 * d.mechanics.J * 1e4, 1e-9);  // all of the kinetic energy
  const double theta = shafts.m.theta;
  shafts.run(1.0, 0.0);
  EXPECT_EQ(shafts.m.theta, theta);
  EXPECT_EQ(shafts.m.omega, 0.0);
}

TEST(Mechanics, ViscousFrictionDecaysExponentially) {
  DriveParams d = ideal_drive();
  d.mechanics.B = 1e-3;
  Shafts shafts(d);
  shafts.m.omega = 50.0;
  const double tau = d.mechanics.J / d.mechanics.B;  // 93 ms
  shafts.run(0.2, 0.0);
  // Midpoint rule: (T/τ)²/12 = 1e-8 per unit of t/τ.
  EXPECT_NEAR(shafts.m.omega, 50.0 * std::exp(-0.2 / tau), 50.0 * 1e-7);
  EXPECT_NEAR(shafts.friction, 0.5 * d.mechanics.J * (2500.0 - shafts.m.omega * shafts.m.omega),
              1e-9);
}

TEST(Mechanics, StaticFrictionHoldsAgainstASmallTorque) {
  DriveParams d = with_friction(0.01);
  d.mechanics.tau_static = 0.012;
  d.load.tau = 0.004;
  Shafts shafts(d);
  shafts.m.theta = 0.123;
  shafts.m.theta_out = 0.123;
  const int seconds = lk::test::all_values() ? 600 : 6;
  for (int n = 0; n < seconds * 32000; ++n) {
    shafts.step(n % 2 == 0 ? 0.0079 : -0.0159);  // just inside ±0.012 with the load
  }
  EXPECT_EQ(shafts.m.theta, 0.123);
  EXPECT_EQ(shafts.m.omega, 0.0);
  EXPECT_EQ(shafts.friction, 0.0);
}

TEST(Mechanics, BreaksAwayAtTheStaticTorque) {
  DriveParams d = with_friction(0.010);
  d.mechanics.tau_static = 0.015;
  d.mechanics.omega_stribeck = 2.0;
  Shafts below(d);
  below.run(1.0, 0.015 * (1.0 - 1e-9));
  EXPECT_EQ(below.m.omega, 0.0);
  Shafts above(d);
  above.run(5.0, 0.015 * (1.0 + 1e-3));  // grows from 0.16 rad/s² as the Stribeck excess fades
  EXPECT_GT(above.m.omega, 10.0);
}

TEST(Mechanics, StribeckExcessHalvesAtItsSpeed) {
  // At ω = ω_s friction is τ_c + (τ_s − τ_c)/2, measured by the deceleration of one period.
  DriveParams d = with_friction(0.010);
  d.mechanics.tau_static = 0.016;
  d.mechanics.omega_stribeck = 2.0;
  for (const auto& [omega, level] :
       {std::pair{2.0, 0.013}, {4e3, 0.010}, {4.0, 0.010 + 0.006 / 5.0}}) {
    Shafts shafts(d);
    shafts.m.omega = omega;
    shafts.step(0.0);
    const double torque = (omega - shafts.m.omega) * d.mechanics.J * shafts.p.f_s;
    EXPECT_NEAR(torque, level,
                1e-8 * (1.0 + omega));  // a difference of speeds: rounding grows with ω
  }
}

TEST(Mechanics, FrictionIsEqualInBothDirections) {
  DriveParams d = with_friction(0.01);
  d.mechanics.B = 1e-4;
  Shafts forth(d);
  Shafts back(d);
  forth.m.omega = 30.0;
  back.m.omega = -30.0;
  forth.run(0.3, 0.03);
  back.run(0.3, -0.03);
  EXPECT_EQ(forth.m.omega, -back.m.omega);
  EXPECT_EQ(forth.m.theta, -back.m.theta);
}

TEST(Mechanics, CoggingIsAConservativePotential) {
  DriveParams d = ideal_drive();
  d.mechanics.tau_cogging = 0.005;
  d.mechanics.cogging_per_turn = 84;
  Shafts shafts(d);
  shafts.m.theta = shafts.m.theta_out = 0.1 * kPiT / 84;
  // Small oscillation about 0: ω² = τ·n/J.
  const double omega = std::sqrt(0.005 * 84 / d.mechanics.J);
  const double period = 2.0 * kPiT / omega;
  // Pendulum at amplitude φ = 0.1·π: the period is longer by φ²/16 = 0.62 %. Crossings are known to
  // a period.
  const double measured = period_of(shafts, 1.0, [](const Shafts& x) { return x.m.theta; });
  EXPECT_NEAR(measured, period * (1.0 + std::pow(0.1 * kPiT, 2) / 16.0), 1e-3 * period);
  // A rotor with more energy than the barrier 2·τ/n passes over it.
  for (const double part : {0.99, 1.01}) {
    Shafts turning(d);
    turning.m.omega = std::sqrt(2.0 * (2.0 * 0.005 / 84) / d.mechanics.J) * part;
    turning.run(1.0, 0.0);
    EXPECT_EQ(std::abs(turning.m.theta) > 2.0 * kPiT / 84, part > 1.0) << turning.m.theta;
  }
}

TEST(Mechanics, RotorWithoutCoggingStoresNoCoggingEnergy) {
  DriveParams d = ideal_drive();
  d.mechanics.cogging_per_turn = 0;
  d.mechanics.tau_cogging = 0.005;
  const BarePlant plant(d);
  EXPECT_NEAR(stored_energy(plant.p, plant.s), 0.5 * d.supply.C_link * 24.0 * 24.0, 1e-12);
}

}  // namespace mechanics_test
}  // namespace lk::model::test
