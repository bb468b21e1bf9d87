// Compares motions with an independent solver at tight tolerance.
#include "tests/model/reference_solver.hpp"

#include "tests/model/profiles.hpp"
#include "tests/model/reference_firmware.hpp"

namespace lk::model::test {
namespace reference_solver_test {

DriveParams smooth_drive() {
  DriveParams d = ideal_drive();
  d.motor.L_q = 2.0 * d.motor.L_d;
  d.motor.alpha_cu = 0.00393;
  d.motor.alpha_pm = -0.0011;
  d.inverter.t_dead = 100e-9;
  d.inverter.R_on = 10e-3;
  d.mechanics.B = 1e-4;
  d.mechanics.tau_cogging = 0.004;
  d.load.tau_gravity = 0.15;
  d.load.J = 1e-4;
  d.supply = {.v_source = 24.0, .R_source = 0.05, .C_link = 470e-6, .i_regen_max = 1e3};
  return d;
}

TEST(ReferenceSolver, AgreesOverTwoSecondsOfClosedLoopMotion) {
  const DriveParams d = smooth_drive();
  ControlSettings settings = unlimited();
  settings.i_q_max = 8.0;
  settings.accel_max = 800.0;
  DriveBank bank = one_drive(d, settings);
  Firmware firmware(d, settings);
  ReferenceSolver reference(d, {0, 0, 0, 0, 24.0, 25.0, 25.0, 25.0});

  // Torque is last: it leaves the angle free, so an angle difference would persist (cogging: 84
  // periods a turn).
  const std::array<Setpoint, 6> script{Speed{80.0},          Speed{-60.0}, Position{3.0},
                                       Position{-9.0, 40.0}, Speed{120.0}, Torque{-1.0}};
  // Requirement: 0.5 % of the rated current, 0.1 % of the fastest speed of the run.
  const double i_rated = 1.0 / k_t(d.motor);  // MF7015-10T: 1 Nm
  const double i_tolerance = 0.005 * i_rated;
  double fastest = 0.0;
  double worst_i = 0.0;
  double worst_omega = 0.0;
  double worst_temp = 0.0;
  double largest_i = 0.0;
  const double T = 1.0 / d.inverter.f_pwm;
  for (const Setpoint& setpoint : script) {
    bank.command(0, setpoint);
    firmware.command(setpoint);
    for (std::int64_t n = ticks_in(d, 2.0 / 6.0); n > 0; --n) {
      bank.advance(1);
      reference.advance(firmware.step(reference.state()), T);
      const Truth t = bank.truth(0);
      const ReferenceState r = reference.state();
      fastest = std::max(fastest, std::abs(r[3]));
      largest_i = std::max(largest_i, std::abs(r[1]));
      worst_i = std::max({worst_i, std::abs(t.i_d - r[0]), std::abs(t.i_q - r[1])});
      worst_omega = std::max(worst_omega, std::abs(t.omega_m - r[3]));
      worst_temp = std::max(worst_temp, std::abs(t.temp_winding - r[5]));
    }
  }
  EXPECT_LT(worst_i, i_tolerance);
  EXPECT_LT(worst_omega, 1e-3 * fastest);
  EXPECT_LT(worst_temp, 0.01);
  EXPECT_GT(fastest, 100.0);  // the script has moved it
  EXPECT_GT(largest_i, 4.0);
  RecordProperty("worst_current_of_rated", std::to_string(worst_i / i_rated));
  RecordProperty("worst_speed_of_fastest", std::to_string(worst_omega / fastest));
}

/// Removes effects from `profile` that the reference equations or ideal sensors lack, so that both
/// compute equal models.
DriveParams smooth(DriveParams profile) {
  MechanicsParams& m = profile.mechanics;
  m.tau_coulomb = m.tau_static = m.tau_coulomb_out = m.gear_stiffness_out = m.backlash_out = 0.0;
  m.gear_efficiency = 1.0;
  profile.encoder = {.bits = 18, .latency = 0.0};
  profile.current_sensor = {.range = profile.current_sensor.range, .bits = 20, .noise = 0.0};
  profile.slow_sensor = {.v_lsb = 1e-4, .v_noise = 0.0, .temp_lsb = 1e-3};
  profile.supply.i_logic = 0.0;
  return profile;
}

/// Current steps at the voltage limit, in both directions, at rest and at full speed, up to four
/// fifths of the sensor range. Requirement: at most 5 % of the step.
TEST(ReferenceSolver, AgreesAtTheVoltageLimit) {
  std::size_t checked = 0;
  for (const NamedDrive& drive : all_profiles()) {
    const DriveParams d = smooth(drive.init.params);
    if (!d.control.has_current_loop) continue;
    for (const double share : {0.06, 0.6, 0.8}) {
      const double step_A = share * d.current_sensor.range;
      DriveBank bank = one_drive(d, unlimited());
      Firmware firmware(d, unlimited());
      ReferenceSolver reference(d, {0, 0, 0, 0, d.supply.v_source, 25, 25, 25});
      double worst_A = 0.0;
      const auto run = [&](const Setpoint& setpoint, double seconds) {
        bank.command(0, setpoint);
        firmware.command(setpoint);
        for (std::int64_t n = ticks_in(d, seconds); n > 0; --n) {
          bank.advance(1);
          reference.advance(firmware.step(reference.state()), 1.0 / d.inverter.f_pwm);
          worst_A = std::max(worst_A, std::abs(bank.truth(0).i_q - reference.state()[1]));
        }
      };
      // The strongest motor reaches its top speed between two steps.
      for (const double seconds : {0.005, 0.05}) {
        run(Torque{step_A}, seconds);
        run(Torque{-step_A}, seconds);
        run(Torque{0.0}, 0.002);
      }
      EXPECT_LT(worst_A, 0.05 * step_A) << drive.name << ", " << step_A << " A";
      ++checked;
    }
  }
  EXPECT_EQ(checked, 75U);
}

/// Largest errors of i_q and ω over 30 ms under duties prescribed every 125 µs, with `parts`
/// periods each.
struct Errors {
  double current = 0, speed = 0;
};
Errors errors_with(int parts) {
  DriveParams d = smooth_drive();
  d.inverter.t_dead = 0.0;  // its sign is defined at the period's start
  d.supply.C_link = 10e-3;
  d.inverter.f_pwm = 8000.0;
  ReferenceSolver reference(d, {0, 0, 0, 30.0, 24.0, 25.0, 25.0, 25.0});
  d.inverter.f_pwm *= parts;
  BarePlant plant(d);
  plant.s.omega = 30.0;
  Errors worst;
  for (int n = 0; n < 240; ++n) {
    // A voltage vector that rotates with the rotor's initial speed and varies in amplitude.
    const double angle = d.motor.pole_pairs * 30.0 * (n + 0.5) * 125e-6 + 1.4;
    const double amplitude = (2.2 + 0.6 * std::sin(0.05 * n)) / 24.0;
    const Abc<double> duty =
        inverse_clarke(AlphaBeta<double>{amplitude * std::cos(angle), amplitude * std::sin(angle)});
    const Abc<double> legs{0.5 + duty.a, 0.5 + duty.b, 0.5 + duty.c};
    reference.advance({legs.a, legs.b, legs.c}, 125e-6);
    for (int k = 0; k < parts; ++k) {
      plant.step(legs);
    }
    const ReferenceState r = reference.state();
    worst.current = std::max(worst.current, std::hypot(plant.s.i_d - r[0], plant.s.i_q - r[1]));
    worst.speed = std::max(worst.speed, std::abs(plant.s.omega - r[3]));
  }
  return worst;
}

TEST(ReferenceSolver, ErrorFallsWithTheSquareOfThePeriod) {
  Errors coarse = errors_with(1);
  for (const int parts : {2, 4, 8}) {
    const Errors fine = errors_with(parts);
    // Second order: a quarter, with a margin for higher orders at the coarsest step.
    EXPECT_GT(coarse.current / fine.current, 3.3) << parts;
    EXPECT_LT(coarse.current / fine.current, 5.0) << parts;
    EXPECT_GT(coarse.speed / fine.speed, 3.3) << parts;
    EXPECT_LT(coarse.speed / fine.speed, 5.0) << parts;
    coarse = fine;
  }
  EXPECT_LT(coarse.current, 1e-2);
}

}  // namespace reference_solver_test
}  // namespace lk::model::test
