#include "model/control/current_loop_params.hpp"
#include "model/control/motion_loops.hpp"
#include "tests/model/support.hpp"

namespace lk::model::test {
namespace shaft_test {

DriveParams stiff_gear(double stiffness) {
  DriveParams d = ideal_drive();
  d.mechanics.gear_ratio = 6.0;
  d.mechanics.gear_stiffness_out = stiffness;
  d.mechanics.gear_damping_out = stiffness > 0.0 ? 1.0 : 0.0;
  d.mechanics.J_out = 1e-3;
  d.mechanics.backlash_out = stiffness > 0.0 ? 1e-3 : 0.0;
  d.mechanics.tau_coulomb = d.mechanics.tau_static = 0.01;
  return d;
}

TEST(TurnedShaft, KeepsItsNewAngleUnderPower) {
  for (const double stiffness : {0.0, 3000.0}) {
    for (const double angle : {0.2, 1.57, -3.0}) {
      const DriveParams d = stiff_gear(stiffness);
      DriveBank bank = one_drive(d);
      bank.advance(ticks_in(d, 0.05));
      bank.turn_shaft(0, angle);
      bank.advance(ticks_in(d, 0.2));
      EXPECT_NEAR(bank.truth(0).theta_out, angle, 0.01) << stiffness;
      EXPECT_NEAR(bank.truth(0).theta_m, 6.0 * angle, 0.06) << stiffness;
      EXPECT_NEAR(bank.telemetry(0).omega, 0.0, 0.1);
    }
  }
}

TEST(TurnedShaft, StopsAtTheEndStop) {
  for (const double stiffness : {0.0, 3000.0}) {
    DriveParams d = stiff_gear(stiffness);
    d.load.theta_min = -0.2;
    d.load.theta_max = 0.2;
    DriveBank bank = one_drive(d);
    bank.turn_shaft(0, 1.5);
    bank.advance(ticks_in(d, 0.1));
    EXPECT_NEAR(bank.truth(0).theta_out, 0.2, 1e-3);
    bank.turn_shaft(0, -50.0);
    bank.advance(ticks_in(d, 0.1));
    EXPECT_NEAR(bank.truth(0).theta_out, -0.2, 1e-3);
  }
}

TEST(EndStops, LetAShaftBeyondThemReturn) {
  for (const double stiffness : {0.0, 3000.0}) {
    const DriveParams d = stiff_gear(stiffness);
    DriveBank bank = one_drive(d);
    bank.turn_shaft(0, 1.0);
    LoadParams load;
    load.theta_min = -0.2;
    load.theta_max = 0.2;
    bank.set_load(0, load);
    bank.command(0, Torque{2.0});  // outwards
    bank.advance(ticks_in(d, 0.2));
    EXPECT_NEAR(bank.truth(0).theta_out, 1.0, 0.01) << stiffness;
    bank.command(0, Torque{-2.0});  // and back, to the other stop
    bank.advance(ticks_in(d, 2.0));
    EXPECT_NEAR(bank.truth(0).theta_out, -0.2, 0.01) << stiffness;
    EXPECT_TRUE(std::isfinite(bank.truth(0).theta_m));
  }
}

TEST(EndStops, DoNotSlowAReturningShaft) {
  for (const double side : {-1.0, 1.0}) {
    DriveParams d = ideal_drive();
    d.load.theta_min = -1.0;
    d.load.theta_max = 1.0;
    Shafts shafts(d);
    shafts.m = {1.2 * side, -3.0 * side, 1.2 * side, -3.0 * side};
    shafts.step(0.0);
    EXPECT_EQ(shafts.m.omega_out, -3.0 * side);
    EXPECT_NEAR(shafts.m.theta_out, side * (1.2 - 3.0 * shafts.p.T_s), 1e-12);
    EXPECT_EQ(shafts.friction, 0.0);
  }
}

TEST(EndStops, LimitOneSideAlone) {
  for (const double side : {-1.0, 1.0}) {
    DriveParams d = stiff_gear(0.0);
    (side > 0.0 ? d.load.theta_max : d.load.theta_min) = 0.2 * side;
    DriveBank bank = one_drive(d);
    bank.command(0, Torque{2.0 * side});
    bank.advance(ticks_in(d, 1.0));
    EXPECT_NEAR(bank.truth(0).theta_out, 0.2 * side, 1e-3);
    bank.command(0, Torque{-2.0 * side});
    bank.advance(ticks_in(d, 1.0));
    EXPECT_LT(bank.truth(0).theta_out * side, -1.0);
  }
}

TEST(EndStops, ImpactLossIsInTheLedger) {
  for (const double stiffness : {0.0, 3000.0}) {
    DriveParams d = stiff_gear(stiffness);
    d.load.J = 0.01;
    d.load.theta_max = 1.0;
    DriveBank bank = one_drive(d);
    const EnergyLedger start = bank.energy(0);
    bank.command(0, Torque{4.0});
    while (bank.truth(0).theta_out < 0.99) {
      bank.advance(1);
    }
    const EnergyLedger before = bank.energy(0);
    bank.advance(ticks_in(d, 0.05));
    const EnergyLedger e = bank.energy(0);
    EXPECT_GT(before.stored - start.stored, 0.1 * before.supply);  // the shaft moved fast
    EXPECT_NEAR(bank.truth(0).omega_out, 0.0, 0.1);
    EXPECT_NEAR(residual(e, start), 0.0, 2e-3 * e.supply) << stiffness;
  }
}

/// A shaft blocked by end stops; the drive tries to turn it for `seconds`.
ErrorBits errors_when_blocked(DriveParams d, const ControlSettings& settings, const Speed& speed) {
  d.load.theta_min = d.load.theta_max = 0.0;
  DriveBank bank = one_drive(d, settings);
  bank.command(0, speed);
  bank.advance(ticks_in(d, 2.0));
  return bank.telemetry(0).errors;
}

TEST(Stall, TripsAtTheLimitInForce) {
  ControlSettings limits = protecting(Error::kStall, {.enabled = true, .threshold = 0.5});
  limits.i_q_max = 8.0;
  EXPECT_EQ(errors_when_blocked(ideal_drive(), limits, {100.0}), bit(Error::kStall));
  EXPECT_EQ(errors_when_blocked(ideal_drive(), limits, {100.0, 1.0}), bit(Error::kStall));

  DriveParams voltage_mode = ideal_drive();
  voltage_mode.control.has_current_loop = false;
  voltage_mode.motor.R_s = 3.0;
  limits.power_max = 0.5;
  EXPECT_EQ(errors_when_blocked(voltage_mode, limits, {100.0}), bit(Error::kStall));
}

TEST(BusCurrent, IsEstimatedFromTheVoltageInVoltageMode) {
  DriveParams d = ideal_drive();
  d.control.has_current_loop = false;
  d.motor.R_s = 3.0;
  d.load.theta_min = d.load.theta_max = 0.0;
  DriveBank bank = one_drive(d);
  bank.command(0, OpenLoop{0.5});
  bank.advance(ticks_in(d, 0.5));
  const Truth truth = bank.truth(0);
  const double v_q = 0.5 * modulation(d.inverter) * 24.0;
  EXPECT_NEAR(truth.i_q, v_q / 3.0, 0.05 * v_q / 3.0);
  EXPECT_NEAR(bank.telemetry(0).i_bus, 1.5 * v_q * v_q / 3.0 / 24.0, 0.02);
}

TEST(Encoder, InvalidAngleReadsZero) {
  for (const double theta_m : {std::nan(""), 1e30, -1e30}) {
    EXPECT_EQ(one_drive(ideal_drive(), unlimited(), theta_m).telemetry(0).encoder_position, 0);
  }
}

}  // namespace shaft_test
}  // namespace lk::model::test
