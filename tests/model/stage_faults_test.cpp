// Faults of the power stage: phases open, switches open or shorted (docs/internals/model.md §14).
#include "model/plant/leg_bridge.hpp"
#include "tests/model/support.hpp"

namespace lk::model::test {
namespace stage_faults_test {

constexpr double kDiode = 0.8;  // V

/// The plant with a faulty stage and a shaft that is turned externally at `omega` rad/s.
struct TurnedPlant : BarePlant {
  LaneFaults faults;
  double omega;

  static DriveParams heavy(DriveParams d) {
    d.mechanics.J = 100.0;
    return d;
  }
  TurnedPlant(const DriveParams& d, const std::array<LegFault, 3>& legs, double speed)
      : BarePlant(heavy(d)), omega(speed) {
    faults.legs = legs;
  }
  void turn(const Abc<double>& duty, bool bridge_on) {
    s.omega = omega;
    s.omega_change = 0.0;
    const SinCos<double> theta_e = sincos<double>(p.pole_pairs * s.theta);
    lk::model::advance<kFaultyParts>(p, s, duty, bridge_on ? 1.0 : 0.0, currents(), theta_e,
                                     &faults);
  }
  /// Steps one period with a voltage [V] on the q axis at the period's middle.
  void turn_with(double v_q) { turn(duty_of({0.0, v_q}, omega), true); }
  Abc<double> currents() const { return phases({s.i_d, s.i_q}, p.pole_pairs * s.theta); }
};

TEST(BrokenLegs, ThreeHealthyLegsEqualTheDrivenWindings) {
  DriveParams d;
  d.motor.L_q = 1.5 * d.motor.L_d;
  PlantParams<double> p = plant_params(d);
  const double omega_e = 800.0;
  for (const double theta_e : {0.3, 1.35, 4.0}) {  // no phase current changes sign
    const Dq<double> i0{-3.0, 8.0};
    const SinCos<double> middle = sincos(theta_e + 0.5 * omega_e * p.T_s);
    const Abc<double> duty{0.62, 0.35, 0.50};
    const Abc<double> i_abc = phases(i0, theta_e);
    const WindingStep<double> exact = driven_windings(p, i0, inverter(p, duty, i_abc, middle), 24.0,
                                                      d.motor.R_s, d.motor.psi_f, omega_e);
    Legs legs;
    const LegParts parts{p.v_diode, p.R_on, p.dead_fraction, p.dead_drop};
    for (std::size_t n = 0; n < 3; ++n) {
      legs[n] = broken_leg(parts, LegFault::kNone, true, std::array{duty.a, duty.b, duty.c}[n]);
    }
    const LegBridgeStep solved = leg_bridge({i0, theta_e, omega_e, 24.0, 0.1, d.motor.R_s,
                                             d.motor.L_d, d.motor.L_q, d.motor.psi_f, p.T_s},
                                            legs);
    // During a period the windings hold the voltage in the rotor frame, the legs in the stator
    // frame. The frame turns by ±ω·T/2 = 0.0125 rad. This changes the mean voltage by its
    // square/24, and the currents, which change by 5 A per period, by as much.
    EXPECT_NEAR(solved.step.i_next.d, exact.i_next.d, 5e-4);
    EXPECT_NEAR(solved.step.i_next.q, exact.i_next.q, 5e-4);
    EXPECT_NEAR(solved.step.i_mean.q, exact.i_mean.q, 5e-3);
    EXPECT_NEAR(solved.step.i_link, exact.i_link, 5e-3);
    EXPECT_NEAR(solved.step.p_inverter, exact.p_inverter, 5e-3 * exact.p_inverter);
    EXPECT_NEAR(solved.p_cut, 0.0, 1e-4);  // rounding of some 10 µJ, 32000 times a second
  }
}

/// Returns τ(θ_e) over an electrical turn as Fourier amplitudes 0, 1, 2, 3.
std::array<double, 4> torque_harmonics(TurnedPlant& plant, double v_q) {
  const int periods = plant.periods(2.0 * kPiT / (plant.p.pole_pairs * plant.omega));
  for (int n = 0; n < 3 * periods; ++n) {
    plant.turn_with(v_q);
  }
  std::array<double, 4> re{};
  std::array<double, 4> im{};
  std::array<double, 4> amplitude{};
  for (int n = 0; n < periods; ++n) {
    const double theta_e = plant.p.pole_pairs * plant.s.theta;
    plant.turn_with(v_q);
    for (std::size_t k = 0; k < 4; ++k) {
      re[k] += plant.s.tau_e * std::cos(static_cast<double>(k) * theta_e);
      im[k] += plant.s.tau_e * std::sin(static_cast<double>(k) * theta_e);
    }
  }
  for (std::size_t k = 0; k < 4; ++k) {
    amplitude[k] = std::hypot(re[k], im[k]) / periods * (k == 0 ? 1.0 : 2.0);
  }
  return amplitude;
}

TEST(BrokenLegs, OpenPhaseHalvesTheTorqueAndAddsItsSecondHarmonic) {
  const DriveParams d = ideal_drive();
  const double omega = 2.0 * kPiT * 16.0 / d.motor.pole_pairs;  // 16 Hz: 2000 periods
  const double emf = d.motor.pole_pairs * omega * d.motor.psi_f;
  const double v_q = emf + 1.0;
  const double whole = k_t(d.motor) * 1.0 / d.motor.R_s;
  for (std::size_t open = 0; open < 3; ++open) {
    std::array<LegFault, 3> legs{};
    legs[open] = LegFault::kPhaseOpen;
    TurnedPlant plant(d, legs, omega);
    const auto harmonics = torque_harmonics(plant, v_q);
    // Two phases in series: √3·(v − e)·sin x/(2·R) against √3·e·sin x gives 3/4, three phases 3/2;
    // sin² is ½ − ½·cos 2x. L delays the current by ω_e·L/R = 0.086.
    EXPECT_NEAR(harmonics[0], 0.5 * whole, 0.01 * whole) << open;
    EXPECT_NEAR(harmonics[2], 0.5 * whole, 0.01 * whole) << open;
    EXPECT_LT(harmonics[1], 0.005 * whole) << open;
    EXPECT_LT(harmonics[3], 0.005 * whole) << open;
    const Abc<double> i = plant.currents();
    EXPECT_NEAR((std::array{i.a, i.b, i.c}[open]), 0.0, 1e-9);
  }
}

TEST(BrokenLegs, OpenPhaseCarriesNoCurrent) {
  DriveParams d;
  d.current_sensor.noise = 0.0;
  DriveBank bank = one_drive(d);
  bank.command(0, Speed{40.0});
  bank.advance(ticks_in(d, 0.1));
  bank.set_faults(0, {.legs = {LegFault::kPhaseOpen}});
  bank.advance(2);  // a sample is one period old
  double largest = 0.0;
  for (int n = 0; n < 6400; ++n) {
    if (n == 3200) {
      bank.command(0, Speed{-20.0});
    }
    bank.advance(1);
    const Truth t = bank.truth(0);
    const Abc<double> i = phases({t.i_d, t.i_q}, d.motor.pole_pairs * t.theta_m);
    // The solver's frame rotates at constant speed, the rotor almost: 1e-4 rad of up to 50 A.
    ASSERT_NEAR(i.a, 0.0, 5e-3);
    ASSERT_EQ(bank.telemetry(0).i_a, 0.0);
    largest = std::max(largest, std::abs(i.b));
  }
  EXPECT_GT(largest, 1.0);
}

TEST(BrokenLegs, OpenSwitchBlocksOneDirection) {
  // At rest with equal legs b and c: the current of a is 2/3·(v_a − v_b)/R.
  const DriveParams d = ideal_drive();
  const double diode_and_back = 1e-6;
  for (const LegFault fault : {LegFault::kHighOpen, LegFault::kLowOpen}) {
    TurnedPlant in(d, {fault, LegFault::kNone, LegFault::kNone}, 0.0);
    TurnedPlant out(d, {fault, LegFault::kNone, LegFault::kNone}, 0.0);
    const double step = 0.05;
    for (int n = 0; n < 3200; ++n) {
      in.turn({0.5 + step, 0.5, 0.5}, true);
      out.turn({0.5 - step, 0.5, 0.5}, true);
    }
    const double whole = 2.0 / 3.0 * 24.0 * step / d.motor.R_s;
    if (fault == LegFault::kHighOpen) {
      EXPECT_NEAR(in.currents().a, 0.0, diode_and_back);
      // Out of the motor: the upper diode replaces the switch, so a is higher by duty·v_d.
      EXPECT_NEAR(out.currents().a, -whole + 2.0 / 3.0 * (0.5 - step) * kDiode / d.motor.R_s,
                  0.01 * whole);
    } else {
      EXPECT_NEAR(out.currents().a, 0.0, diode_and_back);
      EXPECT_NEAR(in.currents().a, whole - 2.0 / 3.0 * (0.5 - step) * kDiode / d.motor.R_s,
                  0.01 * whole);
    }
  }
}

TEST(BrokenLegs, OpenSwitchesHaveNoEffectWhileTheBridgeIsOff) {
  const DriveParams d = ideal_drive();
  TurnedPlant whole(d, {LegFault::kHighOpen, LegFault::kLowOpen, LegFault::kHighOpen}, 400.0);
  BarePlant healthy(TurnedPlant::heavy(d));
  double braking = 0.0;
  double difference = 0.0;
  for (int n = 0; n < 500; ++n) {
    healthy.s.omega = 400.0;
    healthy.s.omega_change = 0.0;
    healthy.free_step();
    whole.turn({0.5, 0.5, 0.5}, false);
    braking += healthy.s.tau_e;
    difference += whole.s.tau_e - healthy.s.tau_e;
  }
  EXPECT_LT(braking / 500, -0.1);
  // The start and end of conduction are known to a sixteenth of a period, with some 20 periods in
  // between.
  EXPECT_NEAR(difference, 0.0, 0.003 * -braking);
}

TEST(BrokenLegs, ShortedSwitchBrakesAboveOneDiodeVoltage) {
  // With the bridge off, current flows through the shorted switch and another leg's diode on that
  // rail. A healthy stage lets the shaft turn freely until the voltage exceeds link and diodes.
  const DriveParams d = ideal_drive();
  const double one_diode = kDiode / (std::sqrt(3.0) * d.motor.psi_f * d.motor.pole_pairs);
  for (const LegFault fault : {LegFault::kHighShorted, LegFault::kLowShorted}) {
    for (const double part : {0.98, 3.0, -3.0}) {
      DriveBank bank = one_drive(d);
      bank.command(0, Off{});
      bank.advance(8);
      bank.set_faults(0, {.legs = {LegFault::kNone, fault}});
      const double omega = part * one_diode;
      bank.kick(0, omega * d.mechanics.J);
      const EnergyLedger start = bank.energy(0);
      bank.advance(ticks_in(d, 1.0));
      const EnergyLedger e = bank.energy(0);
      if (part == 0.98) {
        EXPECT_NEAR(bank.truth(0).omega_m, omega, 1e-9);
        EXPECT_EQ(e.copper, 0.0);
      } else {
        EXPECT_LT(std::abs(bank.truth(0).omega_m), 1.1 * one_diode);
        EXPECT_GT(std::abs(bank.truth(0).omega_m), 0.9 * one_diode);
        // Its energy only heats winding and diode.
        const double lost = start.stored - e.stored;
        EXPECT_NEAR(e.copper - start.copper + e.inverter - start.inverter, lost, 0.01 * lost);
        EXPECT_NEAR(e.supply, start.supply, 1e-6);
      }
    }
  }
}

TEST(BrokenLegs, ShortsToBothRailsFeedTwoPhasesInSeries) {
  DriveParams d = ideal_drive();
  d.inverter.R_on = 10e-3;
  TurnedPlant plant(d, {LegFault::kHighShorted, LegFault::kLowShorted, LegFault::kNone}, 0.0);
  for (int n = 0; n < 3200; ++n) {
    plant.turn({0.5, 0.5, 0.5}, false);
  }
  const double expected = plant.s.v_link / (2.0 * (d.motor.R_s + d.inverter.R_on));
  EXPECT_NEAR(plant.currents().a, expected, 1e-3 * expected);
  EXPECT_NEAR(plant.currents().b, -expected, 1e-3 * expected);
  EXPECT_NEAR(plant.currents().c, 0.0, 1e-6);
  EXPECT_NEAR(plant.s.i_link, expected, 1e-3 * expected);
  EXPECT_NEAR(plant.s.v_link, 24.0 - d.supply.R_source * expected, 0.01);
}

TEST(BrokenLegs, ShootThroughDischargesTheLinkThroughBothSwitches) {
  DriveParams d = ideal_drive();
  d.inverter.R_on = 50e-3;
  d.supply.C_link = 2e-3;
  d.supply.v_source = 0.0;  // disconnected: only the energy of the link remains
  d.supply.i_regen_max = 0.0;
  TurnedPlant plant(d, {LegFault::kNone, LegFault::kNone, LegFault::kHighShorted}, 0.0);
  plant.s.v_link = 24.0;
  // The shorted leg is half high, half in shoot-through. No winding current flows if all legs have
  // equal mean voltage: share 1 − ½·(1 − ½) = ¾.
  const int periods = 32;
  for (int n = 0; n < periods; ++n) {
    plant.turn({0.75, 0.75, 0.5}, true);
    ASSERT_NEAR(plant.currents().c, 0.0, 0.2);
  }
  const double time = periods * plant.p.T_s;
  EXPECT_NEAR(plant.s.v_link, 24.0 * std::exp(-0.5 * time / (0.1 * 2e-3)), 0.02 * 24.0);
  // All energy of the link became heat in the switches.
  const double lost = 0.5 * 2e-3 * (24.0 * 24.0 - plant.s.v_link * plant.s.v_link);
  EXPECT_NEAR(plant.inverter() + plant.copper(), lost, 0.01 * lost);
}

TEST(BrokenLegs, ShortedSwitchResetsTheDriveAndHeatsTheStage) {
  DriveParams d;
  d.logic.v_reset = 6.0;
  d.supply.R_source = 0.5;  // a long cable: 48 A at most
  DriveBank bank = one_drive(d);
  bank.advance(100);
  bank.set_faults(0, {.legs = {LegFault::kHighShorted}});
  double lowest = 24.0;
  for (int n = 0; n < 40; ++n) {
    bank.advance(1);
    lowest = std::min(lowest, bank.truth(0).v_bus);
  }
  EXPECT_LT(lowest, 6.0);
  EXPECT_FALSE(bank.alive(0));
  // When the switches open, the link recovers; the controller boots and closes them again.
  int deaths = 0;
  bool alive = false;
  for (int n = 0; n < 4000; ++n) {
    bank.advance(4);
    deaths += alive && !bank.alive(0) ? 1 : 0;
    alive = bank.alive(0);
    ASSERT_GE(bank.truth(0).v_bus, 0.0);
  }
  EXPECT_GE(deaths, 2);
  EXPECT_GT(bank.truth(0).temp_stage, 25.1);
  bank.set_faults(0, {});
  bank.advance(ticks_in(d, 0.2));
  EXPECT_TRUE(bank.alive(0));
}

TEST(DeadBridge, CarriesNoCurrentWhileTheFirmwareReportsItOn) {
  const DriveParams d = ideal_drive();
  DriveBank bank = one_drive(d);
  bank.command(0, Speed{40.0});
  bank.advance(ticks_in(d, 0.2));
  bank.set_faults(0, {.bridge_dead = true});
  bank.advance(ticks_in(d, 0.01));  // the diodes have reduced the current to zero
  bank.command(0, Torque{10.0});
  const double omega = bank.truth(0).omega_m;
  for (int n = 0; n < 100; ++n) {
    bank.advance(32);
    ASSERT_EQ(bank.truth(0).i_q, 0.0);
    ASSERT_TRUE(bank.telemetry(0).bridge_on);
  }
  EXPECT_EQ(bank.truth(0).omega_m, omega);
  EXPECT_GT(bank.telemetry(0).power, 0.9);  // the controller demands full power
  bank.set_faults(0, {});
  bank.advance(ticks_in(d, 0.01));
  EXPECT_NEAR(bank.truth(0).i_q, 10.0, 0.5);
}

class LegFaults : public testing::TestWithParam<LegFault> {};

TEST_P(LegFaults, LedgerCloses) {
  DriveParams d;
  d.mechanics.tau_coulomb = 0.012;
  d.mechanics.tau_static = 0.014;
  d.mechanics.B = 2e-5;
  d.supply.i_logic = 0.05;
  d.load.J = 2e-4;
  for (const std::array<LegFault, 3>& legs :
       {std::array{GetParam(), LegFault::kNone, LegFault::kNone},
        std::array{LegFault::kNone, GetParam(), LegFault::kPhaseOpen}}) {
    DriveBank bank = one_drive(d);
    bank.command(0, Speed{60.0});
    bank.advance(ticks_in(d, 0.2));
    const EnergyLedger start = bank.energy(0);
    bank.set_faults(0, {.legs = legs});
    for (const Setpoint& setpoint :
         {Setpoint{Speed{60.0}}, Setpoint{Torque{-6.0}}, Setpoint{Position{0.0}}, Setpoint{Off{}},
          Setpoint{Torque{6.0}}}) {
      bank.command(0, setpoint);
      bank.advance(ticks_in(d, 0.2));
    }
    const EnergyLedger e = bank.energy(0);
    const double supplied = e.supply - start.supply;
    EXPECT_GT(supplied, 0.05);
    // 0.1 % of the supplied energy, as in energy_test.
    EXPECT_NEAR(residual(e, start), 0.0, 1e-3 * supplied);
  }
}

INSTANTIATE_TEST_SUITE_P(BrokenLegs, LegFaults,
                         testing::Values(LegFault::kPhaseOpen, LegFault::kHighOpen,
                                         LegFault::kLowOpen, LegFault::kHighShorted,
                                         LegFault::kLowShorted));

}  // namespace stage_faults_test
}  // namespace lk::model::test
