// Gear and load: ratio, efficiency, backlash, gravity arm, end stops (docs/internals/model.md §4).
#include "tests/model/support.hpp"

namespace lk::model::test {
namespace gear_load_test {

TEST(Gear, RigidGearReflectsInertiaByTheSquareOfItsRatio) {
  DriveParams d = geared();
  d.load.J = 2e-3;
  Shafts shafts(d);
  shafts.run(0.1, 0.05);
  const double acceleration = 0.05 / (140e-7 + 2e-3 / 100.0);
  EXPECT_NEAR(shafts.m.omega, acceleration * 0.1, 1e-9 * acceleration);
  EXPECT_EQ(shafts.m.omega_out, shafts.m.omega * 0.1);
  EXPECT_EQ(shafts.m.theta_out, shafts.m.theta * 0.1);
}

TEST(Gear, LoadTorqueActsTowardsLargerAngles) {
  DriveParams d = geared();
  d.load.tau = 0.2;  // at the output: 20 mNm at the rotor
  Shafts shafts(d);
  shafts.run(0.1, 0.0);
  const double acceleration = 0.02 / 140e-7;
  EXPECT_NEAR(shafts.m.omega, acceleration * 0.1, 1e-9 * acceleration);
  EXPECT_NEAR(shafts.load, -0.2 * shafts.m.theta_out, 1e-9);  // the load supplied this energy
}

TEST(Gear, EfficiencyAppliesInBothDirections) {
  DriveParams d = geared();
  d.mechanics.gear_efficiency = 0.8;
  d.load.tau = -1.0;  // at the output: needs 100 mNm at the rotor
  // Lifting takes 100/0.8 = 125 mNm, holding back 0.8·100 = 80 mNm.
  Shafts lifting(d);
  lifting.m.omega = 10.0;
  lifting.run(0.05, 0.125);
  EXPECT_NEAR(lifting.m.omega, 10.0, 1e-9);
  Shafts lowering(d);
  lowering.m.omega = -10.0;
  lowering.run(0.05, 0.080);
  EXPECT_NEAR(lowering.m.omega, -10.0, 1e-9);
  // Loss: input minus output, times the rotor's angle.
  EXPECT_NEAR(lifting.gear, 0.025 * 10.0 * 0.05, 1e-9);
  EXPECT_NEAR(lowering.gear, 0.020 * 10.0 * 0.05, 1e-9);
}

/// Between the lowering and the lifting torque a load rests exactly, without creep.
TEST(Gear, HoldsALoadBetweenLoweringAndLiftingTorque) {
  DriveParams d = geared();
  d.mechanics.gear_efficiency = 0.8;
  d.load.tau = -1.0;  // lifting takes 125 mNm at the rotor, holding back 80 mNm, as above
  for (const double tau : {0.0801, 0.09, 0.1, 0.11, 0.1249}) {
    Shafts resting(d);
    resting.run(0.1, tau);
    EXPECT_EQ(resting.m.theta, 0.0) << tau;
  }
  // Outside this range the rest of the torque accelerates it.
  for (const auto& [tau, left] : {std::pair(0.135, 0.010), std::pair(0.070, -0.010)}) {
    Shafts moving(d);
    moving.run(0.1, tau);
    EXPECT_NEAR(moving.m.omega, left / 140e-7 * 0.1, 1e-9 / 140e-7) << tau;
  }
}

TEST(Gear, RigidGearHasTheFrictionOfTheOutput) {
  DriveParams d = geared();
  d.mechanics.tau_coulomb_out = 1.0;
  d.load.tau = 0.5;
  Shafts shafts(d);
  shafts.run(0.05, 0.0);
  EXPECT_EQ(shafts.m.omega, 0.0);  // 0.5 Nm do not overcome 1 Nm
}

DriveParams with_play() {
  DriveParams d = geared();
  d.mechanics.backlash_out = 0.01;
  d.mechanics.gear_stiffness_out = 500.0;
  d.mechanics.gear_damping_out = 0.5;
  d.mechanics.J_out = 1e-3;
  return d;
}

TEST(Backlash, RotorTurnsFreelyThroughThePlay) {
  const DriveParams d = with_play();
  Shafts shafts(d);
  shafts.m.theta =
      -0.05 + 1e-6;  // the lower end of the play, ±0.005 at the output, ±0.05 at the rotor
  shafts.m.omega = 1.0;
  const double omega = shafts.m.omega;
  shafts.run(0.0995, 0.0);  // 0.1 rad at 1 rad/s take 100 ms
  EXPECT_EQ(shafts.m.omega, omega);
  EXPECT_EQ(shafts.m.theta_out, 0.0);
  shafts.run(0.02, 0.0);
  EXPECT_LT(shafts.m.omega, 0.9 * omega);
  EXPECT_GT(shafts.m.theta_out, 0.0);
}

TEST(Backlash, OutputLagsByHalfThePlay) {
  // Drives slowly forward, then back: the output lags the rotor by half the play in each direction.
  DriveParams d = with_play();
  d.mechanics.tau_coulomb_out = 0.2;  // holds the output while the rotor crosses the play
  d.mechanics.B = 1e-3;
  Shafts shafts(d);
  shafts.run(0.5, 0.05);
  const double twist_forth = shafts.m.theta / 10.0 - shafts.m.theta_out;
  shafts.run(0.5, -0.05);
  const double twist_back = shafts.m.theta / 10.0 - shafts.m.theta_out;
  // The spring adds torque/stiffness to the play, with a torque between friction (0.2 Nm) and 0.5
  // Nm.
  EXPECT_GT(twist_forth, 0.005 + 0.2 / 500.0);
  EXPECT_LT(twist_forth, 0.005 + 0.5 / 500.0);
  EXPECT_LT(twist_back, -0.005 - 0.2 / 500.0);
  EXPECT_GT(twist_back, -0.005 - 0.5 / 500.0);
}

TEST(Backlash, TwoBodiesOscillateAtTheirFrequency) {
  DriveParams d = with_play();
  d.mechanics.backlash_out = 0.0;
  d.mechanics.gear_damping_out = 0.0;
  Shafts shafts(d);
  shafts.m.theta_out = 1e-3;
  // Output side: J_r·N² = 1.4e-3 against J_out = 1e-3, stiffness 500.
  const double omega = std::sqrt(500.0 * (1.0 / 1.4e-3 + 1.0 / 1e-3));
  const auto twist = [](const Shafts& x) { return x.m.theta_out - x.m.theta / 10.0; };
  const double period = period_of(shafts, 1.0, twist);
  // (ω·T)²/24 = 3.5e-5 of the Verlet scheme, and crossings known to a period in one second.
  EXPECT_NEAR(2.0 * kPiT / period, omega, 2e-4 * omega);
  const double energy = 0.5 * 140e-7 * shafts.m.omega * shafts.m.omega +
                        0.5 * 1e-3 * shafts.m.omega_out * shafts.m.omega_out +
                        250.0 * std::pow(twist(shafts), 2);
  EXPECT_NEAR(energy, 250e-6,
              0.02 * 250e-6);  // symplectic: oscillates by (ω·T/2) without drift
}

TEST(Gravity, ArmSwingsWithThePeriodOfAPendulum) {
  DriveParams d = ideal_drive();
  d.load.J = 0.02;
  d.load.tau_gravity = 1.5;
  Shafts shafts(d);
  shafts.m.theta = shafts.m.theta_out = 0.1;
  const double period = 2.0 * kPiT * std::sqrt((0.02 + d.mechanics.J) / 1.5) * (1.0 + 0.01 / 16.0);
  EXPECT_NEAR(period_of(shafts, 10.0, [](const Shafts& x) { return x.m.theta; }), period,
              1e-4 * period);  // next term: 11·φ⁴/3072 = 4e-7
}

TEST(Gravity, IsZeroWhenTheArmHangsAndLargestWhenItIsLevel) {
  DriveParams d = ideal_drive();
  d.load.tau_gravity = 2.0;
  for (const auto& [angle, torque] :
       {std::pair{0.0, 0.0}, {kPiT / 2, -2.0}, {-kPiT / 2, 2.0}, {kPiT / 6, -1.0}}) {
    Shafts shafts(d);
    shafts.m.theta = shafts.m.theta_out = angle;
    shafts.step(0.0);
    EXPECT_NEAR(shafts.m.omega * d.mechanics.J * shafts.p.f_s, torque,
                4e-9);  // 2 Nm · the sine's 2e-9
  }
}

TEST(EndStops, StopTheOutputAndLetItReturn) {
  for (const bool compliant : {false, true}) {
    DriveParams d = compliant ? with_play() : geared();
    d.load.theta_min = -0.5;
    d.load.theta_max = 0.7;
    Shafts shafts(d);
    shafts.run(2.0, 0.02);
    EXPECT_NEAR(shafts.m.theta_out, 0.7, 1e-4) << compliant;  // one period beyond, then clamped
    EXPECT_NEAR(shafts.m.omega_out, 0.0, 1e-2) << compliant;
    shafts.run(0.05, -0.02);
    EXPECT_LT(shafts.m.theta_out, 0.69) << compliant;
    shafts.run(2.0, -0.02);
    EXPECT_NEAR(shafts.m.theta_out, -0.5, 1e-4) << compliant;
  }
}

}  // namespace gear_load_test
}  // namespace lk::model::test
