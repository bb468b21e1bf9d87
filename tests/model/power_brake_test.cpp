#include "model/control/current_loop_params.hpp"
#include "model/control/motion_loops.hpp"
#include "model/control/protection.hpp"
#include "model/plant/brake.hpp"
#include "tests/model/support.hpp"

namespace lk::model::test {
namespace power_brake_test {

TEST(Life, DiesBelowTheThresholdAndBootsAboveTheHysteresis) {
  const LogicParams p{.v_reset = 6.0, .v_reset_hysteresis = 0.5, .boot_time = 0.01};
  LifeState s;
  EXPECT_FALSE(live(p, 6.0, 1e-3, s));
  EXPECT_TRUE(live(p, 5.99, 1e-3, s));  // powers down
  EXPECT_EQ(s.life, Life::kInReset);
  EXPECT_FALSE(live(p, 6.49, 1e-3, s));
  EXPECT_EQ(s.life, Life::kInReset);
  EXPECT_FALSE(live(p, 6.5, 1e-3, s));
  EXPECT_EQ(s.life, Life::kBooting);
  EXPECT_FALSE(live(p, 6.2, 1e-3, s));  // within the hysteresis booting continues
  EXPECT_FALSE(live(p, 5.9, 1e-3, s));  // a second dip restarts the boot
  EXPECT_EQ(s.life, Life::kInReset);
  live(p, 24.0, 1e-3, s);
  int periods = 0;
  while (!live(p, 24.0, 1e-3, s) && periods < 100) {
    ++periods;
  }
  EXPECT_NEAR((periods + 1) * 1e-3, 0.01, 1.01e-3);
  EXPECT_EQ(s.life, Life::kAlive);
}

TEST(Supply, ElectronicsDischargeADisconnectedLink) {
  DriveParams d = ideal_drive();
  d.supply.i_logic = 0.048;  // 500 ohm
  d.logic.v_reset = 0.0;
  DriveBank bank = one_drive(d);
  bank.connect_supply(0, false);
  bank.advance(ticks_in(d, 0.25));
  // v = 24 V·e^(−t/(R·C)), R·C = 0.5 s
  EXPECT_NEAR(bank.truth(0).v_bus, 24.0 * std::exp(-0.5), 0.01);
  const double supplied = bank.energy(0).supply;
  EXPECT_EQ(supplied, 0.0);
  bank.connect_supply(0, true);
  bank.advance(ticks_in(d, 0.01));
  EXPECT_NEAR(bank.truth(0).v_bus, 24.0, 0.01);
}

TEST(Supply, ElectronicsAreInTheLedger) {
  DriveParams d = ideal_drive();
  d.supply.i_logic = 0.5;
  DriveBank bank = one_drive(d);
  const EnergyLedger start = bank.energy(0);
  bank.command(0, Speed{50.0});
  bank.advance(ticks_in(d, 1.0));
  const EnergyLedger e = bank.energy(0);
  EXPECT_GT(e.inverter, 0.9 * 24.0 * 0.5);
  EXPECT_NEAR(residual(e, start), 0.0, 1e-3 * e.supply);
}

TEST(Reset, OpensTheBridgeAndEndsInIdle) {
  DriveParams d = ideal_drive();
  d.logic = {.v_reset = 6.0, .v_reset_hysteresis = 0.5, .boot_time = 0.01};
  DriveBank bank = one_drive(d);
  bank.command(0, Torque{2.0});
  bank.advance(ticks_in(d, 0.05));
  EXPECT_GT(bank.truth(0).i_q, 1.0);
  bank.set_supply_voltage(0, 3.0);
  EXPECT_TRUE(bank.advance_to_edge(bank.ticks() + ticks_in(d, 1.0)));
  EXPECT_FALSE(bank.alive(0));
  EXPECT_FALSE(bank.telemetry(0).bridge_on);
  const double omega = bank.truth(0).omega_m;
  bank.set_supply_voltage(0, 24.0);
  EXPECT_TRUE(bank.advance_to_edge(bank.ticks() + ticks_in(d, 1.0)));
  EXPECT_TRUE(bank.alive(0));
  bank.advance(ticks_in(d, 0.1));
  EXPECT_NEAR(bank.truth(0).i_q, 0.0, 0.05);                // idle
  EXPECT_NEAR(bank.truth(0).omega_m, omega, 0.05 * omega);  // the shaft keeps coasting
}

TEST(Reset, NeedsEnoughSupplyToBoot) {
  DriveParams d = ideal_drive();
  d.logic = {.v_reset = 6.0, .v_reset_hysteresis = 0.5, .boot_time = 0.01};
  d.supply.v_source = 5.9;
  DriveBank bank = one_drive(d);
  EXPECT_FALSE(bank.alive(0));
  bank.advance(ticks_in(d, 0.1));
  EXPECT_FALSE(bank.alive(0));
  EXPECT_FALSE(bank.telemetry(0).bridge_on);
  bank.set_supply_voltage(0, 24.0);
  bank.advance(ticks_in(d, 0.1));
  EXPECT_TRUE(bank.alive(0));
}

TEST(Brake, HoldsUpToItsTorque) {
  DriveParams d = ideal_drive();
  d.brake = {.tau = 0.05, .engage_time = 0.02, .release_time = 0.04};
  d.load.tau = 0.049;
  DriveBank bank = one_drive(d);
  bank.command(0, Off{});
  bank.advance(ticks_in(d, 1.0));
  EXPECT_EQ(bank.truth(0).theta_m, 0.0);  // engaged from power-up; the shaft stays exactly
  bank.set_brake_coil(0, true);
  bank.advance(ticks_in(d, 0.1));
  EXPECT_GT(bank.truth(0).omega_m, 1.0);
  bank.set_brake_coil(0, false);
  bank.advance(ticks_in(d, 2.0));  // 0.051 Nm minus 0.049 Nm: only about 1 mNm stops it
  const double before = bank.truth(0).omega_m;
  bank.set_load(0, {});
  bank.advance(ticks_in(d, 0.5));
  EXPECT_LT(bank.truth(0).omega_m, before);
  EXPECT_EQ(bank.truth(0).omega_m, 0.0);
}

TEST(Brake, TorqueChangesLinearlyWithTime) {
  const BrakeParams p{.tau = 1.0, .engage_time = 0.02, .release_time = 0.04};
  BrakeState s{.coil_on = true};
  for (int n = 0; n < 10; ++n) {
    move_brake(p, 1e-3, s);
  }
  EXPECT_NEAR(s.pressed, 0.75, 1e-12);
  s.coil_on = false;
  for (int n = 0; n < 4; ++n) {
    move_brake(p, 1e-3, s);
  }
  EXPECT_NEAR(s.pressed, 0.95, 1e-12);
  move_brake(p, 1e-3, s);
  EXPECT_FALSE(move_brake(p, 1e-3, s));
  EXPECT_EQ(s.pressed, 1.0);
}

TEST(Brake, ActsAtOnceWithoutDelays) {
  const BrakeParams p{.tau = 1.0, .engage_time = 0.0, .release_time = 0.0};
  BrakeState s{.coil_on = true};
  EXPECT_TRUE(move_brake(p, 1e-3, s));
  EXPECT_EQ(s.pressed, 0.0);
  s.coil_on = false;
  EXPECT_TRUE(move_brake(p, 1e-3, s));
  EXPECT_EQ(s.pressed, 1.0);
  EXPECT_FALSE(move_brake(p, 1e-3, s));
}

TEST(Brake, StaysClosedWithoutPower) {
  DriveParams d = ideal_drive();
  d.brake = {.tau = 0.5, .engage_time = 0.001, .release_time = 0.001};
  d.logic.v_reset = 6.0;
  DriveBank bank = one_drive(d);
  bank.set_brake_coil(0, true);
  bank.command(0, Speed{100.0});
  bank.advance(ticks_in(d, 0.5));
  EXPECT_NEAR(bank.truth(0).omega_m, 100.0, 1.0);
  bank.set_supply_voltage(0, 0.0);
  bank.advance(ticks_in(d, 0.2));
  EXPECT_EQ(bank.truth(0).omega_m, 0.0);
  bank.set_brake_coil(0, true);  // no controller runs to receive it
  bank.set_supply_voltage(0, 24.0);
  bank.advance(ticks_in(d, 0.2));
  bank.command(0, Torque{0.1});
  bank.advance(ticks_in(d, 0.2));
  EXPECT_EQ(bank.truth(0).omega_m, 0.0);  // still engaged after the boot
}

TEST(Protection, UnrecoverableErrorStaysUntilARestart) {
  DriveParams d = ideal_drive();
  DriveBank bank = one_drive(
      d,
      protecting(Error::kUnderVoltage, {.enabled = true, .threshold = 20.0, .recoverable = false}));
  bank.set_supply_voltage(0, 15.0);
  bank.advance(ticks_in(d, 0.01));
  bank.set_supply_voltage(0, 24.0);
  bank.advance(ticks_in(d, 0.01));
  bank.clear_errors(0);
  EXPECT_EQ(bank.telemetry(0).errors, bit(Error::kUnderVoltage));
  bank.restart(0);
  bank.advance(ticks_in(d, 0.01));
  EXPECT_EQ(bank.telemetry(0).errors, 0);
  EXPECT_TRUE(bank.telemetry(0).bridge_on);
}

TEST(VoltageMode, MaxPowerLimitsOnlyTheSpeedLoop) {
  DriveParams d = ideal_drive();
  d.control.has_current_loop = false;
  d.motor.R_s = 2.0;
  ControlSettings settings = unlimited();
  settings.power_max = 0.4;
  DriveBank bank = one_drive(d, settings);
  const double omega_full =
      modulation(d.inverter) * 24.0 / (d.motor.pole_pairs * d.motor.psi_f);  // no load
  bank.command(0, Speed{omega_full});
  bank.advance(ticks_in(d, 3.0));
  EXPECT_NEAR(bank.telemetry(0).power, 0.4, 0.002);
  EXPECT_NEAR(bank.truth(0).omega_m, 0.4 * omega_full, 0.02 * omega_full);
  bank.command(0, OpenLoop{0.8});
  bank.advance(ticks_in(d, 3.0));
  EXPECT_NEAR(bank.telemetry(0).power, 0.8, 0.002);
  EXPECT_NEAR(bank.truth(0).omega_m, 0.8 * omega_full, 0.02 * omega_full);
}

}  // namespace power_brake_test
}  // namespace lk::model::test
