// Compares DC link and heat with closed forms (docs/internals/model.md §5, §6).
#include "tests/model/support.hpp"

namespace lk::model::test {
namespace supply_thermal_test {

TEST(Supply, LinkFollowsTheExponentialOfItsCapacitor) {
  DriveParams d = ideal_drive();
  d.supply = {.v_source = 24.0, .R_source = 0.5, .C_link = 470e-6, .i_regen_max = 1e3};
  const PlantParams<double> p = plant_params(d);
  const double tau = 0.5 * 470e-6;
  double v = 24.0;
  double charge = 0.0;
  for (int n = 1; n <= 64; ++n) {
    const LinkStep<double> s = link(p, v, 6.0);
    v = s.v_next;
    charge += s.i_source * p.T_s;
    // 24 V − 0.5 Ω · 6 A = 21 V in the end.
    // The decay's series ends with x⁷/7!, x = T/τ = 0.13: error 1.5e-10 a period, at most 1.4e-9 V.
    EXPECT_NEAR(v, 21.0 + 3.0 * std::exp(-n * p.T_s / tau), 2e-9);
    // The source's charge is the load's minus the capacitor's.
    EXPECT_NEAR(charge, 6.0 * n * p.T_s + 470e-6 * (v - 24.0), 1e-12);
  }
}

TEST(Supply, BlockedRegenerationChargesTheLinkLinearly) {
  DriveParams d = ideal_drive();
  d.supply = {.v_source = 24.0, .R_source = 0.05, .C_link = 470e-6, .i_regen_max = 0.0};
  const PlantParams<double> p = plant_params(d);
  double v = 24.0;
  for (int n = 1; n <= 320; ++n) {  // 10 ms of 1 A fed back
    const LinkStep<double> s = link(p, v, -1.0);
    v = s.v_next;
    EXPECT_EQ(s.i_source, 0.0);
    EXPECT_NEAR(v, 24.0 + n * p.T_s / 470e-6, 1e-9);
  }
  // The source absorbs 0.4 A; the rest charges the link.
  d.supply.i_regen_max = 0.4;
  const LinkStep<double> part = link(plant_params(d), v, -1.0);
  EXPECT_EQ(part.i_source, -0.4);
  EXPECT_NEAR(part.v_next - v, 0.6 * p.T_s / 470e-6, 1e-9);
}

/// Link voltage of a drive that spins up and brakes to a stop: highest while braking, lowest while
/// accelerating.
struct Extremes {
  double lowest = 1e9, highest = -1e9;
};
Extremes spin_and_brake(double i_regen_max) {
  DriveParams d = ideal_drive();
  d.supply = {.v_source = 24.0, .R_source = 0.2, .C_link = 2e-3, .i_regen_max = i_regen_max};
  d.load.J = 2e-4;
  DriveBank bank = one_drive(d);
  Extremes e;
  bank.command(0, Torque{10.0});
  for (int n = 0; n < 300; ++n) {
    bank.advance(16);
    e.lowest = std::min(e.lowest, bank.truth(0).v_bus);
  }
  bank.command(0, Torque{-6.0});
  for (int n = 0; n < 2000 && bank.truth(0).omega_m > 5.0; ++n) {
    bank.advance(16);
    e.highest = std::max(e.highest, bank.truth(0).v_bus);
  }
  return e;
}

TEST(Supply, SagsUnderLoadAndRisesWhenBraking) {
  const Extremes free = spin_and_brake(1e3);
  const Extremes limited = spin_and_brake(0.5);
  const Extremes blocked = spin_and_brake(0.0);
  EXPECT_LT(free.lowest, 23.8);  // 10 A at speed: tens of watts over 0.2 Ω
  EXPECT_GT(free.lowest, 18.0);
  EXPECT_GT(free.highest, 24.05);
  EXPECT_GT(limited.highest, free.highest + 0.2);
  EXPECT_GT(blocked.highest, limited.highest + 0.2);
  EXPECT_LT(blocked.highest, 100.0);
}

/// Regression: noise at an empty link gave a negative voltage, and a negative voltage circle gave
/// NaN.
TEST(Supply, EmptyLinkKeepsTheStateFinite) {
  ControlSettings settings;
  settings.gains.current_kp = settings.gains.current_ki = 0;
  DriveBank bank = one_drive(DriveParams{}, settings);
  bank.command(0, Speed{10.0, 0.0});
  bank.advance(320);
  bank.set_supply_voltage(0, 0.0);
  bank.advance(32000);
  EXPECT_GE(bank.telemetry(0).v_bus, 0.0);
  EXPECT_LT(bank.truth(0).v_bus, 1e-3);
  EXPECT_TRUE(std::isfinite(bank.truth(0).omega_m));
  EXPECT_TRUE(std::isfinite(bank.truth(0).i_q));
}

TEST(Heat, WindingFollowsItsExponential) {
  DriveParams d = ideal_drive();
  d.thermal.C_housing = 1e12;
  const ThermalParams& t = d.thermal;
  const PlantParams<double> p = plant_params(d);
  Temperatures<double> temp{25.0, 25.0, 25.0};
  const double tau = t.R_winding_housing * t.C_winding;  // 45 s
  const double power = 20.0;
  const auto periods = static_cast<int>(tau * p.f_s);
  for (int n = 0; n < periods; ++n) {
    temp = thermal(p, temp, {power, 0.0, 0.0});
  }
  // After one time constant 63.2 % of 30 K. Euler's error: T/(2·τ) = 3.5e-7.
  EXPECT_NEAR(temp.winding, 25.0 + power * t.R_winding_housing * (1.0 - std::exp(-1.0)), 1e-4);
  EXPECT_NEAR(temp.housing, 25.0, 1e-6);
  EXPECT_NEAR(temp.stage, 25.0, 1e-12);
}

TEST(Heat, PowerStageHasItsOwnTimeConstant) {
  DriveParams d = ideal_drive();
  const PlantParams<double> p = plant_params(d);
  Temperatures<double> temp{25.0, 25.0, 25.0};
  const double tau = d.thermal.R_stage_ambient * d.thermal.C_stage;  // 225 s
  for (int n = 0; n < static_cast<int>(tau * p.f_s); ++n) {
    temp = thermal(p, temp, {0.0, 0.0, 2.0});
  }
  EXPECT_NEAR(temp.stage, 25.0 + 2.0 * d.thermal.R_stage_ambient * (1.0 - std::exp(-1.0)), 1e-4);
}

TEST(Heat, SteadyStateIsTheSumOfTheResistances) {
  DriveParams d = ideal_drive();
  d.thermal.C_winding = 0.05;
  d.thermal.C_housing = 0.2;
  d.thermal.temp_ambient = 40.0;
  const PlantParams<double> p = plant_params(d);
  Temperatures<double> temp{25.0, 25.0, 25.0};
  for (int n = 0; n < 20 * 32000; ++n) {  // 20 s, time constants below 0.7 s
    temp = thermal(p, temp, {12.0, 3.0, 1.0});
  }
  EXPECT_NEAR(temp.housing, 40.0 + (12.0 + 3.0) * d.thermal.R_housing_ambient, 1e-6);
  EXPECT_NEAR(temp.winding, temp.housing + 12.0 * d.thermal.R_winding_housing, 1e-6);
}

/// The iron's share of the friction warms the winding, the rest the housing; their sum is the
/// shaft's loss, once. Additional friction of a brake or a jam (ten times here) has no iron share.
TEST(Heat, IronShareOfTheFrictionWarmsTheWinding) {
  for (const double others : {0.0, 0.2}) {
    DriveParams d = ideal_drive();
    d.mechanics.J = 1e6;
    d.mechanics.tau_coulomb = 0.02;
    d.mechanics.B = 1e-4;
    d.mechanics.hysteresis_share = d.mechanics.eddy_share = 0.6;
    const MechanicsParams healthy = d.mechanics;
    d.mechanics.tau_coulomb += others;
    BarePlant plant(d);
    set_iron(plant.p, healthy);
    plant.s.omega = 100.0;
    const double seconds = 1.0;
    for (int n = plant.periods(seconds); n > 0; --n) {
      plant.free_step();
    }
    const double iron_W = 0.012 * 100.0 + 0.6e-4 * 100.0 * 100.0;
    const double all_W = (0.02 + others) * 100.0 + 1e-4 * 100.0 * 100.0;
    // Heat flow onwards within a second: 1 s/45 s.
    EXPECT_NEAR(plant.s.temp_winding - 25.0, iron_W * seconds / d.thermal.C_winding,
                0.03 * iron_W / d.thermal.C_winding);
    EXPECT_NEAR(plant.s.temp_housing - 25.0, (all_W - iron_W) * seconds / d.thermal.C_housing,
                0.03 * all_W / d.thermal.C_housing);
    EXPECT_NEAR(plant.s.p_friction * plant.p.T_s, all_W * seconds, 1e-6 * all_W);
  }
}

/// As above, for drives in a bank: one with iron, one without, at equal speed and fault. The
/// difference of the winding temperatures is the share of a healthy drive.
TEST(Heat, FrictionFaultHasNoIronShare) {
  const auto winding_C = [](double share) {
    DriveParams d = ideal_drive();
    d.mechanics.tau_coulomb = d.mechanics.tau_static = 0.01;
    d.mechanics.B = 1e-4;
    d.mechanics.hysteresis_share = d.mechanics.eddy_share = share;
    DriveBank bank = one_drive(d);
    bank.set_faults(0, {.friction = 4.0});
    bank.command(0, Speed{60.0});
    bank.advance(ticks_in(d, 1.0));
    EXPECT_NEAR(bank.truth(0).omega_m, 60.0, 1.0);
    return bank.truth(0).temp_winding;
  };
  const double iron_W = 0.5 * (0.01 * 60.0 + 1e-4 * 60.0 * 60.0);
  // 10 % for the start and for heat flow to the housing.
  const double warmer_K = iron_W * 1.0 / ideal_drive().thermal.C_winding;
  EXPECT_NEAR(winding_C(0.5) - winding_C(0.0), warmer_K, 0.1 * warmer_K);
}

TEST(Heat, CopperLossIsThreeHalvesRISquared) {
  DriveParams d = ideal_drive();
  d.mechanics.J = 1e6;
  d.inverter.R_on = 0.02;
  BarePlant plant(d);
  plant.s.i_q = 5.0;
  for (int n = 0; n < 3200; ++n) {
    plant.step_dq({0.0, (d.motor.R_s + d.inverter.R_on) * 5.0});
  }
  // The duty uses the link voltage at the period's start: within 1e-4.
  EXPECT_NEAR(plant.copper(), 1.5 * d.motor.R_s * 25.0 * 0.1, 2e-3);
  EXPECT_NEAR(plant.inverter(), 1.5 * d.inverter.R_on * 25.0 * 0.1, 4e-4);
}

}  // namespace supply_thermal_test
}  // namespace lk::model::test
