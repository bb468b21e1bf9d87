// Compares a period of the windings with closed forms and a fine Runge–Kutta
// (docs/internals/model.md §3).
#include <functional>

#include "tests/model/support.hpp"

namespace lk::model::test {
namespace windings_test {

struct Machine {
  double R = 0.14, L_d = 0.12e-3, L_q = 0.12e-3, psi = 0.00499, omega_e = 0.0;
};

WindingStep<double> one_period(const Machine& m, const Dq<double>& i0, const Dq<double>& v) {
  DriveParams d = ideal_drive();
  d.motor.L_d = m.L_d;
  d.motor.L_q = m.L_q;
  const PlantParams<double> p = plant_params(d);
  const double v_link = 24.0;
  return driven_windings<double>(p, i0, {{v.d / v_link, v.q / v_link}, {0.0, 0.0}}, v_link, m.R,
                                 m.psi, m.omega_e);
}

Dq<double> slope(const Machine& m, const Dq<double>& i, const Dq<double>& v) {
  return {(v.d - m.R * i.d + m.omega_e * m.L_q * i.q) / m.L_d,
          (v.q - m.R * i.q - m.omega_e * (m.L_d * i.d + m.psi)) / m.L_q};
}

/// Runge–Kutta 4 with `steps` steps; also the means of i_d, i_q, i², i_d·i_q by Simpson's rule.
struct Reference {
  Dq<double> end, mean{};
  double mean_square = 0, mean_dq = 0;
};
Reference runge_kutta(const Machine& m, Dq<double> i, const Dq<double>& v, double T, int steps) {
  Reference r;
  const double h = T / steps;
  const auto weigh = [&r](const Dq<double>& x, double weight) {
    r.mean.d += weight * x.d;
    r.mean.q += weight * x.q;
    r.mean_square += weight * (x.d * x.d + x.q * x.q);
    r.mean_dq += weight * x.d * x.q;
  };
  for (int n = 0; n < steps; ++n) {
    weigh(i, (n == 0 ? 1.0 : n % 2 == 1 ? 4.0 : 2.0) / (3.0 * steps));
    const Dq<double> k1 = slope(m, i, v);
    const Dq<double> k2 = slope(m, {i.d + 0.5 * h * k1.d, i.q + 0.5 * h * k1.q}, v);
    const Dq<double> k3 = slope(m, {i.d + 0.5 * h * k2.d, i.q + 0.5 * h * k2.q}, v);
    const Dq<double> k4 = slope(m, {i.d + h * k3.d, i.q + h * k3.q}, v);
    i = {i.d + h / 6 * (k1.d + 2 * k2.d + 2 * k3.d + k4.d),
         i.q + h / 6 * (k1.q + 2 * k2.q + 2 * k3.q + k4.q)};
  }
  weigh(i, 1.0 / (3.0 * steps));
  r.end = i;
  return r;
}

TEST(Windings, OnePeriodAgreesWithRungeKutta) {
  const double T = 1.0 / 32e3;
  for (const double ratio : {1.0, 2.0, 0.6}) {
    for (const double omega_e : {0.0, -300.0, 3000.0, 15000.0}) {
      Machine m;
      m.L_q = ratio * m.L_d;
      m.omega_e = omega_e;
      const Dq<double> i0{3.0, -8.0};
      const Dq<double> v{-4.0, 9.0};
      const WindingStep<double> step = one_period(m, i0, v);
      const Reference r = runge_kutta(m, i0, v, T, 1000);
      // The sinh and cosh series end before s⁴/8!, s = (ω·T)², of the decaying part i(0) − i∞: less
      // than 60 A.
      const double x = std::abs(omega_e) * T;
      const double cut = 60.0 * std::pow(x, 8) / 40320 + 1e-11;
      EXPECT_NEAR(step.i_next.d, r.end.d, cut) << omega_e;
      EXPECT_NEAR(step.i_next.q, r.end.q, cut) << omega_e;
      // The means use these numbers divided by |A|·T.
      const double damping = m.R / std::min(m.L_d, m.L_q) * T;
      const double decay = std::max(m.R / std::max(m.L_d, m.L_q) * T, x);
      EXPECT_NEAR(step.i_mean.d, r.mean.d, 4 * cut / decay + 1e-10) << omega_e;
      EXPECT_NEAR(step.i_mean.q, r.mean.q, 4 * cut / decay + 1e-10) << omega_e;
      // A parabola through the ends takes the cubic part, i‴·T³/120, for slope. Error of a mean
      // square: Δi·i‴·T³/360, i‴·T³ ≤ (x + R·T/L)²·Δi; twice that for cross terms.
      const double change = std::hypot(r.end.d - i0.d, r.end.q - i0.q);
      const double missed = 2.0 * change * change * std::pow(x + damping, 2) / 360 + 1e-9;
      EXPECT_NEAR(step.mean_square, r.mean_square, missed + 40 * cut / decay) << omega_e;
      EXPECT_NEAR(step.mean_dq, r.mean_dq, missed + 40 * cut / decay) << omega_e;
    }
  }
}

TEST(Windings, ElectricalPowerBalancesWithinThePeriod) {
  // ∫v·i = copper + torque·ω + change of magnetic energy, all from the step's own means.
  const double T = 1.0 / 32e3;
  for (const double ratio : {1.0, 2.0}) {
    Machine m;
    m.L_q = ratio * m.L_d;
    m.omega_e = 2500.0;
    const Dq<double> i0{2.0, 6.0};
    const Dq<double> v{-3.0, 12.0};
    const WindingStep<double> s = one_period(m, i0, v);
    const double in = 1.5 * (v.d * s.i_mean.d + v.q * s.i_mean.q) * T;
    const double copper = 1.5 * m.R * s.mean_square * T;
    const double mechanical =
        1.5 * m.omega_e * (m.psi * s.i_mean.q + (m.L_d - m.L_q) * s.mean_dq) * T;
    const auto magnetic = [&m](const Dq<double>& i) {
      return 0.75 * (m.L_d * i.d * i.d + m.L_q * i.q * i.q);
    };
    // The parabola's error of i² (see above), (ω·T)²·Δi²/360 = 1e-4 A² of 65, affects copper loss,
    // 1 % of the power.
    EXPECT_NEAR(in, copper + mechanical + magnetic(s.i_next) - magnetic(i0), in * 1e-7);
  }
}

TEST(Windings, ReluctanceTorqueHasTheSignOfTheInductanceDifference) {
  DriveParams d = ideal_drive();
  d.motor.L_q = 2.0 * d.motor.L_d;
  const PlantParams<double> p = plant_params(d);
  WindingStep<double> s{};
  s.i_mean = {-5.0, 10.0};
  s.mean_dq = -50.0;
  // 3/2·14·(0.00499·10 + (0.12 − 0.24) mH·(−50)) = 3/2·14·(0.0499 + 0.006) = 1.1739 Nm
  EXPECT_NEAR(torque(p, s, d.motor.psi_f), 1.1739, 1e-12);
}

TEST(Windings, DeadTimeLowersTheVoltageByItsShare) {
  DriveParams d = ideal_drive();
  d.inverter.t_dead = 300e-9;
  d.inverter.i_dead_zone = 0.1;
  const PlantParams<double> p = plant_params(d);
  const double share = 300e-9 * 32e3;
  // Phase a carries 10 A in, b and c 5 A out each; rotor axis on a: the vector (1, −1, −1) has α =
  // 4/3.
  const InverterOutput<double> out =
      inverter<double>(p, {0.5, 0.5, 0.5}, {10.0, -5.0, -5.0}, SinCos<double>{0.0, 1.0});
  EXPECT_NEAR(out.duty.d, -share * 4.0 / 3.0, 1e-15);
  EXPECT_NEAR(out.duty.q, 0.0, 1e-15);
  EXPECT_NEAR(out.v_drop.d, 2.0 * share * d.inverter.v_diode * 4.0 / 3.0, 1e-15);
  // A tenth of the zone: a tenth of the error.
  const InverterOutput<double> small =
      inverter<double>(p, {0.5, 0.5, 0.5}, {0.01, -0.005, -0.005}, SinCos<double>{0.0, 1.0});
  EXPECT_NEAR(small.duty.d, -share * 0.1, 1e-15);
}

TEST(Windings, ResistanceAndFluxFollowTheTemperature) {
  DriveParams d = ideal_drive();
  d.motor.alpha_cu = 0.00393;
  d.motor.alpha_pm = -0.0011;
  d.mechanics.J = 1e6;  // locked
  d.thermal.C_winding = 1e9;
  BarePlant plant(d);
  plant.s.temp_winding = 125.0;
  for (int n = 0; n < 3200; ++n) {  // 0.1 s = 116 time constants
    plant.step_dq({0.0, 0.5});
  }
  // 0.5 V·i over 1 mΩ lowers the link by a few millivolts; the duty follows: v_q is exact to 1e-4.
  EXPECT_NEAR(plant.s.i_q, 0.5 / (0.14 * 1.393), 1e-3);
  EXPECT_NEAR(plant.s.tau_e, 1.5 * 14 * 0.00499 * (1.0 - 0.11) * plant.s.i_q, 1e-9);
}

/// If linear in temperature, ψ would be 0 at 25 + 1/0.0011 = 934 °C and then change sign.
TEST(Windings, HotMagnetMakesNoTorque) {
  DriveParams d = ideal_drive();
  d.motor.alpha_pm = -0.0011;
  d.mechanics.J = 1e6;  // locked
  d.thermal.C_winding = 1e9;
  BarePlant plant(d);
  plant.s.temp_winding = 1500.0;
  for (int n = 0; n < 320; ++n) {
    plant.step_dq({0.0, 0.5});
  }
  ASSERT_GT(plant.s.i_q, 1.0);
  EXPECT_EQ(plant.s.tau_e, 0.0);  // L_d = L_q: no torque without a magnet
}

}  // namespace windings_test
}  // namespace lk::model::test
