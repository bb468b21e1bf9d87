// Faults of mechanics and power: jams, friction, broken couplings, end stops, failing supply
// (docs/internals/model.md §14).
#include "tests/model/support.hpp"

namespace lk::model::test {
namespace plant_faults_test {

DriveParams springy() {
  DriveParams d = geared();
  d.mechanics.gear_ratio = 6.0;
  d.mechanics.backlash_out = 0.02;
  d.mechanics.gear_stiffness_out = 400.0;
  d.mechanics.gear_damping_out = 0.3;
  d.mechanics.J_out = 5e-4;
  return d;
}

DriveBank pushing(const DriveParams& d, const Faults& faults, double i_q) {
  DriveBank bank = one_drive(d);
  bank.set_faults(0, faults);
  bank.command(0, Torque{i_q});
  bank.advance(ticks_in(d, 0.5));
  return bank;
}

TEST(MechanicalFault, FullJamHoldsTheShaft) {
  for (DriveParams d : {ideal_drive(), geared()}) {
    d.load.tau = 1e4;
    DriveBank bank = pushing(d, {.jam = 1.0}, d.current_sensor.range);
    EXPECT_GT(bank.truth(0).tau_e, 0.5 * k_t(d.motor) * d.current_sensor.range);
    EXPECT_EQ(bank.truth(0).theta_m, 0.0);
    EXPECT_EQ(bank.truth(0).omega_m, 0.0);
  }
}

TEST(MechanicalFault, HalfAJamNeedsHalfOfTheFullScaleTorque) {
  // An equal share of the current for any gear: the output torque counts.
  for (const DriveParams& d : {ideal_drive(), geared(), springy()}) {
    const double half = 0.5 * d.current_sensor.range;
    const DriveBank below = pushing(d, {.jam = 0.5}, 0.99 * half);
    const DriveBank above = pushing(d, {.jam = 0.5}, 1.01 * half);
    EXPECT_NEAR(below.truth(0).i_q, 0.99 * half, 0.05);
    EXPECT_EQ(below.truth(0).omega_out, 0.0);
    if (d.mechanics.backlash_out == 0.0) {  // with play, the rotor's first impact moves it
      EXPECT_EQ(below.truth(0).theta_out, 0.0);
    }
    EXPECT_GT(above.truth(0).omega_out, 0.1);
  }
}

/// Returns the speed after `seconds` of coasting from 100 rad/s.
double coasted(const DriveParams& d, const Faults& faults, double seconds) {
  DriveBank bank = one_drive(d);
  bank.command(0, Off{});
  bank.advance(8);
  bank.set_faults(0, faults);
  bank.kick(0, 100.0 * d.mechanics.J);
  bank.advance(ticks_in(d, seconds));
  return bank.truth(0).omega_m;
}

TEST(MechanicalFault, FrictionFactorScalesTheDeceleration) {
  DriveParams viscous = ideal_drive();
  viscous.mechanics.B = 1e-4;
  const double rate = 1e-4 / viscous.mechanics.J;
  for (const double factor : {0.0, 0.5, 1.0, 3.0}) {
    EXPECT_NEAR(coasted(viscous, {.friction = factor}, 0.5), 100.0 * std::exp(-factor * rate * 0.5),
                1e-4)
        << factor;
  }
  DriveParams dry = ideal_drive();
  dry.mechanics.tau_coulomb = dry.mechanics.tau_static = 0.01;
  for (const double factor : {0.5, 1.0, 3.0}) {
    EXPECT_NEAR(coasted(dry, {.friction = factor}, 0.2),
                100.0 - factor * 0.01 / dry.mechanics.J * 0.2, 1e-6)
        << factor;
  }
}

TEST(MechanicalFault, InertiaFactorScalesTheAcceleration) {
  DriveParams d = geared();
  d.load.J = 2e-3;
  const double J = d.mechanics.J + d.load.J / 100.0;
  for (const double factor : {1.0, 2.0, 0.5}) {
    DriveBank bank = one_drive(d);
    bank.set_faults(0, {.inertia = factor, .load_torque = 0.2});
    bank.command(0, Off{});
    bank.advance(ticks_in(d, 0.1));
    // 0.2 Nm at the output, 0.02 Nm at the rotor.
    EXPECT_NEAR(bank.truth(0).omega_m, 0.02 / (factor * J) * 0.1, 1e-6) << factor;
  }
}

TEST(MechanicalFault, BacklashFactorScalesThePlay) {
  const DriveParams d = springy();
  const double tau = 0.5 * k_t(d.motor);  // at 0.5 A
  const double spring = 2.0 * tau * d.mechanics.gear_ratio / d.mechanics.gear_stiffness_out;
  for (const double factor : {0.0, 1.0, 3.0}) {
    DriveBank bank = one_drive(d);
    bank.set_faults(0, {.jam = 1.0, .backlash = factor});
    double ends[2];
    for (const int side : {0, 1}) {
      bank.command(0, Torque{side == 0 ? -0.5 : 0.5});
      bank.advance(ticks_in(d, 2.0));
      ends[side] = bank.truth(0).theta_m / d.mechanics.gear_ratio;
    }
    EXPECT_EQ(bank.truth(0).theta_out, 0.0);
    EXPECT_NEAR(ends[1] - ends[0], factor * 0.02 + spring, 2e-4) << factor;
  }
}

TEST(MechanicalFault, BrokenCouplingSeparatesRotorAndOutput) {
  for (DriveParams d : {geared(), springy()}) {
    d.mechanics.J_out = 5e-4;
    d.load.J = 2e-3;
    d.load.tau = 0.05;
    DriveBank bank = one_drive(d);
    bank.command(0, Off{});
    bank.set_faults(0, {.coupling_broken = true});
    bank.advance(ticks_in(d, 0.1));
    EXPECT_EQ(bank.truth(0).omega_m, 0.0);
    EXPECT_NEAR(bank.truth(0).omega_out, 0.05 / 2.5e-3 * 0.1, 1e-9);
    bank.command(0, Torque{1.0});
    bank.advance(ticks_in(d, 0.01));
    // With its own inertia only; current and setpoint take a millisecond.
    const double acceleration = k_t(d.motor) / d.mechanics.J;
    EXPECT_NEAR(bank.truth(0).omega_m, acceleration * 0.01, 0.1 * acceleration * 0.01);
    EXPECT_NEAR(bank.truth(0).omega_out, 0.05 / 2.5e-3 * 0.11, 1e-9);
  }
}

TEST(MechanicalFault, BrokenCouplingWorksWithoutOutputInertia) {
  DriveParams d = ideal_drive();
  d.load.tau = 0.01;
  DriveBank bank = one_drive(d);
  bank.set_faults(0, {.coupling_broken = true});
  bank.command(0, Speed{20.0});
  bank.advance(ticks_in(d, 0.5));
  EXPECT_NEAR(bank.truth(0).omega_m, 20.0, 0.05);
  EXPECT_EQ(bank.truth(0).omega_out, 0.0);
}

TEST(MechanicalFault, ReconnectedShaftsShareTheirMomentum) {
  DriveParams d = geared();
  d.load.J = 4.2e-3;  // 420e-7 at the rotor, three times its own
  DriveBank bank = one_drive(d);
  bank.command(0, Off{});
  bank.advance(8);
  bank.set_faults(0, {.coupling_broken = true});
  bank.kick(0, 4.2e-3 * 5.0);  // the output only
  bank.advance(ticks_in(d, 0.1));
  EXPECT_NEAR(bank.truth(0).omega_out, 5.0, 1e-9);
  EXPECT_EQ(bank.truth(0).omega_m, 0.0);
  const EnergyLedger start = bank.energy(0);
  bank.set_faults(0, {});
  EXPECT_NEAR(bank.truth(0).omega_m, 0.75 * 50.0, 1e-9);
  EXPECT_NEAR(bank.truth(0).omega_out, 0.75 * 5.0, 1e-10);
  EXPECT_NEAR(bank.truth(0).theta_out, bank.truth(0).theta_m / 10.0, 1e-12);
  EXPECT_LT(bank.energy(0).stored, start.stored);
  EXPECT_NEAR(residual(bank.energy(0), start), 0.0, 1e-12);
}

TEST(MechanicalFault, KickCountsAsWorkOfTheLoad) {
  for (const DriveParams& d : {geared(), springy()}) {
    DriveBank bank = one_drive(d);
    bank.command(0, Off{});
    bank.advance(8);
    const EnergyLedger start = bank.energy(0);
    bank.kick(0, 1e-3);
    const double J = d.mechanics.gear_stiffness_out > 0.0
                         ? d.mechanics.J_out
                         : d.mechanics.J * d.mechanics.gear_ratio * d.mechanics.gear_ratio;
    EXPECT_NEAR(bank.truth(0).omega_out, 1e-3 / J, 1e-9);
    EXPECT_NEAR(bank.energy(0).load - start.load, -0.5 * 1e-6 / J, 1e-12);
    EXPECT_NEAR(residual(bank.energy(0), start), 0.0, 1e-12);
  }
}

TEST(MechanicalFault, NearerEndStopOfFaultAndLoadActs) {
  DriveParams d = geared();
  d.load.theta_max = 2.0;
  DriveBank bank = one_drive(d);
  bank.set_faults(0, {.theta_min = -0.5, .theta_max = 3.0});
  bank.command(0, Torque{0.2});
  bank.advance(ticks_in(d, 0.5));
  EXPECT_EQ(bank.truth(0).theta_out, 2.0);  // the nearer one
  bank.command(0, Torque{-0.2});
  bank.advance(ticks_in(d, 0.5));
  EXPECT_EQ(bank.truth(0).theta_out, -0.5);
  bank.set_faults(0, {});
  bank.advance(ticks_in(d, 0.1));
  EXPECT_LT(bank.truth(0).theta_out, -0.6);
}

TEST(PowerFault, SagAndCutLowerTheLink) {
  DriveParams d = ideal_drive();
  d.supply.i_logic = 0.048;  // 500 ohm, R·C = 0.5 s
  d.logic.v_reset = 6.0;
  DriveBank bank = one_drive(d);
  bank.set_faults(0, {.v_source_max = 12.0});
  bank.advance(ticks_in(d, 0.05));
  EXPECT_NEAR(bank.truth(0).v_bus, 12.0, 0.01);
  bank.set_faults(0, {.v_source_max = 30.0});
  bank.advance(ticks_in(d, 0.05));
  EXPECT_NEAR(bank.truth(0).v_bus, 24.0, 0.01);
  bank.command(0, Off{});
  bank.set_faults(0, {.supply_cut = true});
  bank.connect_supply(0, true);  // without effect
  bank.advance(ticks_in(d, 0.25));
  EXPECT_NEAR(bank.truth(0).v_bus, 24.0 * std::exp(-0.5), 0.02);
  bank.advance(ticks_in(d, 0.6));
  EXPECT_FALSE(bank.alive(0));
  bank.set_faults(0, {});
  bank.advance(ticks_in(d, 0.2));
  EXPECT_TRUE(bank.alive(0));
  EXPECT_NEAR(bank.truth(0).v_bus, 24.0, 0.01);
}

TEST(PowerFault, BlockedRegenerationChargesTheLink) {
  DriveParams d = ideal_drive();
  d.motor.R_s = 0.02;
  d.supply.C_link = 470e-6;
  for (const bool fault : {false, true}) {
    ControlSettings settings = unlimited();
    settings.i_q_max = 10.0;
    DriveBank bank = one_drive(d, settings);
    bank.set_faults(0, {.no_regeneration = fault});
    bank.command(0, Speed{60.0});
    bank.advance(ticks_in(d, 0.5));
    const double kinetic = 0.5 * d.mechanics.J * 60.0 * 60.0;
    bank.command(0, Speed{0.0});
    const EnergyLedger start = bank.energy(0);
    double highest = 0.0;
    for (int n = 0; n < 1000; ++n) {
      bank.advance(8);
      const double v = bank.truth(0).v_bus;
      highest = std::max(highest, v);
      // The link has at most the initial energy of all parts and the source's supply.
      const double all = start.stored + bank.energy(0).supply - start.supply;
      if (fault) {
        ASSERT_LT(0.5 * 470e-6 * v * v, 1.001 * all);
      }
    }
    const double most = std::sqrt(24.0 * 24.0 + 2.0 * kinetic / 470e-6);
    if (fault) {
      EXPECT_GT(highest, 24.0 + 0.5 * (most - 24.0));
    } else {
      EXPECT_LT(highest, 24.1);
    }
  }
}

TEST(PlantFault, SuddenChangesAreInTheLedger) {
  DriveParams d = springy();
  d.load.tau_gravity = 0.3;
  d.mechanics.tau_coulomb = 0.002;
  d.mechanics.tau_static = 0.003;
  DriveBank bank = one_drive(d);
  const EnergyLedger start = bank.energy(0);
  bank.command(0, Speed{30.0});
  for (const Faults& faults :
       {Faults{.inertia = 3.0}, Faults{.friction = 2.0, .backlash = 0.2},
        Faults{.coupling_broken = true}, Faults{.jam = 0.01, .load_torque = -0.05}, Faults{}}) {
    bank.advance(ticks_in(d, 0.2));
    bank.set_faults(0, faults);
    bank.kick(0, 1e-4);
  }
  bank.advance(ticks_in(d, 0.2));
  const EnergyLedger end = bank.energy(0);
  EXPECT_GT(end.supply - start.supply, 0.05);
  EXPECT_NEAR(residual(end, start), 0.0, 1e-3 * (end.supply - start.supply));
}

}  // namespace plant_faults_test
}  // namespace lk::model::test
