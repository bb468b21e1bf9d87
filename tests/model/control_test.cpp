// The control loops behave as designed (docs/internals/model.md §10, §11).
#include <complex>

#include "model/control/current_loop_params.hpp"
#include "model/control/motion_loops.hpp"
#include "model/rounding.hpp"
#include "tests/model/support.hpp"

namespace lk::model::test {
namespace control_test {

TEST(VoltageLimits, StallCurrentIsVoltageOverResistance) {
  DriveParams d = ideal_drive();
  d.motor.R_s = 1.0;
  d.mechanics.J = 1e3;  // locked
  d.inverter.duty_max = 0.98;
  DriveBank bank = one_drive(d);
  bank.command(0, Torque{30.0});
  bank.advance(ticks_in(d, 0.05));  // 400 time constants L/R
  // The legs use 0.96 of the link: a circle of 0.96/√3 · 24 V; the link sags by 1 mΩ · 9 A.
  EXPECT_NEAR(bank.truth(0).i_q, 0.96 / std::sqrt(3.0) * 24.0 / 1.0, 0.02);
  EXPECT_NEAR(bank.truth(0).i_d, 0.0, 0.02);
}

TEST(VoltageLimits, NoLoadSpeedIsVoltageOverFlux) {
  DriveParams d = ideal_drive();
  DriveBank bank = one_drive(d);
  bank.command(0, Torque{0.2});
  bank.advance(ticks_in(d, 4.0));
  const double swing = 2.0 * d.inverter.duty_max - 1.0;
  const double expected = swing / std::sqrt(3.0) * 24.0 / (d.motor.pole_pairs * d.motor.psi_f);
  EXPECT_NEAR(bank.truth(0).omega_m, expected,
              0.01 * expected);  // i_d of the limited controller: ω·L·i
}

TEST(VoltageMode, SpeedRisesWithTheMechanicalTimeConstant) {
  DriveParams d = ideal_drive();
  d.control.has_current_loop = false;
  d.motor.R_s = 2.0;
  d.motor.L_d = d.motor.L_q = 0.3e-3;
  DriveBank bank = one_drive(d);
  bank.command(0, OpenLoop{2.0 / (modulation(d.inverter) * d.supply.v_source)});
  // τ_m = J·R/(3/2·p²·ψ²); ω∞ = v/(p·ψ). L changes both by (ω·L/R)² = 0.4 %, L/R delays by 0.15 ms.
  const double p_psi = d.motor.pole_pairs * d.motor.psi_f;
  const double tau = d.mechanics.J * d.motor.R_s / (1.5 * p_psi * p_psi);
  bank.advance(ticks_in(d, tau));
  EXPECT_NEAR(bank.truth(0).omega_m, (1.0 - std::exp(-1.0)) * 2.0 / p_psi, 0.015 * 2.0 / p_psi);
  bank.advance(ticks_in(d, 9.0 * tau));
  EXPECT_NEAR(bank.truth(0).omega_m, 2.0 / p_psi, 0.01 * 2.0 / p_psi);
}

/// Returns gain and phase of i_q over its reference at `omega` rad/s, with a locked rotor, tick by
/// tick.
std::complex<double> current_response(const DriveParams& d, const ControlSettings& settings,
                                      double omega) {
  BarePlant plant(d);
  plant.p.inertia_rate = 1e12;
  plant.p.mobility = 0.0;
  const CurrentLoopParams<double> params = current_loop_params(d, settings);
  CurrentLoopState<double> loop;
  CurrentOrders<double> orders;
  orders.bridge_on = 1.0;
  orders.v_bus = d.supply.v_source;
  const int period = static_cast<int>(std::lround(2.0 * kPiT / omega * d.inverter.f_pwm));
  const double exact = 2.0 * kPiT / period;  // rad per tick
  std::complex<double> response = 0.0;
  for (int n = 0; n < 40 * period; ++n) {
    orders.i_q_ref = 1.0 * std::sin(exact * n);
    if (n >= 20 * period) {
      response +=
          plant.s.i_q * std::exp(std::complex<double>(0.0, -exact * n)) * 2.0 / (20.0 * period);
    }
    const Abc<double> duty{loop.duty_a, loop.duty_b, loop.duty_c};
    const bool on = loop.bridge != 0.0;
    const Abc<double> i =
        inverse_clarke(inverse_park(Dq<double>{plant.s.i_d, plant.s.i_q}, sincos(0.0)));
    std::uint64_t noise = 1;
    current_loop(params, orders, hold(params, orders), measure<double>(plant.p, i, 0.0, 0.0, noise),
                 loop);
    plant.step(duty, on);
  }
  return response * std::complex<double>(0.0, 1.0);  // reference is a sine
}

TEST(CurrentLoop, HasItsDesignedBandwidth) {
  DriveParams d = ideal_drive();
  d.control.current_bandwidth = 2.0 * kPiT * 500.0;
  ControlSettings settings = unlimited();
  settings.gains.current_kp = settings.gains.current_ki =
      static_cast<std::uint8_t>(d.control.ref_current_byte);
  const double T = 1.0 / d.inverter.f_pwm;
  for (const double part : {0.1, 0.5, 1.0, 2.0}) {
    const double omega = part * d.control.current_bandwidth;
    // K_p = ω_c·L, K_i = ω_c·R cancel the winding's pole. The open loop is ω_c/(jω)·e^(−jω·1.5·T):
    // a delay of one period for computation and half a period for the hold.
    const std::complex<double> j(0.0, 1.0);
    const std::complex<double> open = 1.0 / (j * part) * std::exp(-j * omega * 1.5 * T);
    const std::complex<double> expected = open / (1.0 + open);
    const std::complex<double> measured = current_response(d, settings, omega);
    // The continuous-time model is accurate to (ω·T)²; at 2·ω_c that is 4 %.
    EXPECT_NEAR(std::abs(measured), std::abs(expected), 0.02 + 0.5 * std::pow(omega * T, 2))
        << part;
    EXPECT_NEAR(std::arg(measured / expected), 0.0, 0.03 + std::pow(omega * T, 2)) << part;
  }
}

TEST(CurrentLoop, BandwidthScalesWithTheByte) {
  // At a tenth of the frequency of byte `b`'s bandwidth the phase lag is 0.1 rad plus the delay's.
  const DriveParams d = ideal_drive();
  double last = 0.0;
  for (const int byte : {10, 20, 40, 60}) {
    ControlSettings settings = unlimited();
    settings.gains.current_kp = settings.gains.current_ki = static_cast<std::uint8_t>(byte);
    const double omega_c = d.control.current_bandwidth * byte / d.control.ref_current_byte;
    const std::complex<double> at = current_response(d, settings, 0.2 * omega_c);
    EXPECT_NEAR(std::arg(at), -std::atan(0.2), 0.25 * std::atan(0.2)) << byte;
    const double stiff = std::abs(current_response(d, settings, 2000.0));
    EXPECT_GT(stiff, last) << byte;
    last = stiff;
  }
}

TEST(CurrentLoop, FollowsATorqueCommandWithoutError) {
  DriveParams d = ideal_drive();
  d.motor.L_q = 2.0 * d.motor.L_d;
  d.mechanics.B = 2e-3;  // settles at k_t·i/B = 105 rad/s
  DriveBank bank = one_drive(d);
  bank.command(0, Torque{2.0});
  bank.advance(ticks_in(d, 1.0));
  EXPECT_NEAR(bank.truth(0).i_q, 2.0, 0.02);
  EXPECT_NEAR(bank.truth(0).i_d, 0.0, 0.05);  // delay compensation and rounding of angles
  EXPECT_NEAR(bank.truth(0).omega_m, 2.0 * k_t(d.motor) / 2e-3, 0.02 * 105.0);
}

/// Returns the time from a small speed step to half of it, s.
double time_to_half(const DriveParams& d, const GainBytes& gains) {
  ControlSettings settings = unlimited();
  settings.gains = gains;
  DriveBank bank = one_drive(d, settings);
  bank.command(0, Speed{2.0});
  for (int n = 1; n < 64000; ++n) {
    bank.advance(1);
    if (bank.truth(0).omega_m > 1.0) {
      return n / d.inverter.f_pwm;
    }
  }
  return 1e9;
}

TEST(SpeedLoop, RisesAtItsDesignedBandwidth) {
  DriveParams d = ideal_drive();
  d.control.speed_bandwidth = 50.0;
  d.control.speed_integral_rate = 0.0;
  d.control.J_nominal = d.mechanics.J;
  d.control.estimator_bandwidth = 3000.0;
  GainBytes gains;
  gains.speed_kp = static_cast<std::uint8_t>(d.control.ref_speed_kp_byte);
  // First order: ln 2/ω_s, delayed by the faster elements: current loop 1/ω_c, observer 2/ω_o, one
  // motion period.
  const double expected = std::log(2.0) / 50.0;
  const double later = 1.0 / d.control.current_bandwidth + 2.0 / 3000.0 +
                       2.0 * d.control.motion_divider / d.inverter.f_pwm;
  EXPECT_GT(time_to_half(d, gains), 0.97 * expected);
  EXPECT_LT(time_to_half(d, gains), expected + 1.5 * later);
}

TEST(SpeedLoop, LargerBytesAreFasterAndExtremesStayFinite) {
  DriveParams d = ideal_drive();
  double last = 1e6;
  for (const int byte : {10, 25, 50, 80}) {
    GainBytes gains;
    gains.speed_kp = static_cast<std::uint8_t>(byte);
    gains.speed_ki = 0;
    const double t = time_to_half(d, gains);
    EXPECT_LT(t, last) << byte;
    last = t;
  }
  for (const int byte : {0, 255}) {
    const auto b = static_cast<std::uint8_t>(byte);
    ControlSettings settings = unlimited();
    settings.gains = {b, b, b, b, b, b};
    DriveBank bank = one_drive(d, settings);
    for (const Setpoint& setpoint :
         {Setpoint{Speed{50.0}}, Setpoint{Position{3.0}}, Setpoint{Torque{3.0}}}) {
      bank.command(0, setpoint);
      bank.advance(ticks_in(d, 0.5));
      const Truth t = bank.truth(0);
      EXPECT_TRUE(std::isfinite(t.omega_m) && std::isfinite(t.i_q) && std::isfinite(t.i_d)) << byte;
      if (byte == 0) {  // no gains: no torque except the decoupling of a turning rotor
        EXPECT_NEAR(t.omega_m, 0.0, 0.1);
      }
    }
  }
}

TEST(PositionLoop, LargerBytesAreStifferAgainstALoad) {
  // Without integrators the shaft yields by τ/(K_angle·K_speed·k_t).
  double last = 1e9;
  for (const int byte : {20, 40, 80, 160}) {
    DriveParams d = ideal_drive();
    d.load.tau = 0.05;
    ControlSettings settings = unlimited();
    settings.gains.angle_kp = static_cast<std::uint8_t>(byte);
    settings.gains.angle_ki = settings.gains.speed_ki = 0;
    DriveBank bank = one_drive(d, settings);
    bank.command(0, Position{0.0});
    bank.advance(ticks_in(d, 2.0));
    const MotionParams p = motion_params(d, settings);
    const double expected = 0.05 / (p.angle_kp * p.speed_kp * k_t(d.motor));
    EXPECT_NEAR(bank.truth(0).theta_m, expected, 0.02 * expected + 3.0 * std::abs(p.rad_per_count))
        << byte;
    EXPECT_LT(bank.truth(0).theta_m, last) << byte;
    last = bank.truth(0).theta_m;
  }
}

/// An integral gain of 0 disables its term and clears its state (docs/internals/model.md §11).
TEST(IntegralGains, ZeroClearsTheSpeedIntegral) {
  DriveParams d = ideal_drive();
  d.load.tau = 0.05;
  ControlSettings settings = unlimited();
  DriveBank bank = one_drive(d, settings);
  bank.command(0, Speed{20.0});
  bank.advance(ticks_in(d, 2.0));
  EXPECT_NEAR(bank.truth(0).omega_m, 20.0, 0.02);
  settings.gains.speed_ki = 0;
  bank.configure(0, settings);
  bank.advance(ticks_in(d, 1.0));
  // The load needs a current of −τ/k_t, which is K_p times the error.
  const double error = 0.05 / (k_t(d.motor) * motion_params(d, settings).speed_kp);
  EXPECT_NEAR(bank.truth(0).omega_m, 20.0 + error, 0.02 * error);
}

/// The delays of both estimates match docs/internals/model.md, measured on a shaft with constant
/// acceleration.
TEST(Estimator, DelaysFollowFromTheBandwidths) {
  DriveParams d = ideal_drive();
  d.encoder.bits = 18;
  d.control.estimator_bandwidth = 4000.0;
  d.control.report_bandwidth = 1000.0;
  const MotionParams p = motion_params(d, unlimited());
  MotionState s = motion_state_at(p, 0.0);
  CurrentOrders<double> orders;
  constexpr double kAcceleration = 200.0;  // rad/s²
  double late = 0.0;
  double late_report = 0.0;
  const int periods = 8000;  // 1 s, whole windows
  const int settled = 800;
  for (int n = 1; n <= periods; ++n) {
    const double t = n * p.T_m;
    const double counts = floored(0.5 * kAcceleration * t * t * p.counts_per_rad);
    motion_loops(p, Idle{}, counts, 24.0, s, orders);
    if (n > settled) {
      late += (t - s.omega_hat / kAcceleration) / (periods - settled);
      late_report += (t - s.omega_report / kAcceleration) / (periods - settled);
    }
  }
  // Quantisation averages out to one count over the run: 2.4e-5 rad/(0.9 s·200 rad/s²) = 1e-7 s.
  EXPECT_NEAR(late, 1.0 / 4000.0 + 0.5 * p.T_m, 1e-6);
  // Mean age of the held value: from the middle of a window, half a window, plus half a hold. The
  // last period of a hold is not sampled.
  EXPECT_NEAR(late_report, 1e-3 - 0.5 * p.T_m, 1e-6);
}

TEST(IntegralGains, ZeroClearsTheAngleIntegral) {
  const DriveParams d = ideal_drive();
  ControlSettings settings = unlimited();
  MotionParams p = motion_params(d, settings);
  MotionState s = motion_state_at(p, 0.0);
  CurrentOrders<double> orders;
  const Position target{0.01};  // of a shaft held at 0
  for (int n = 0; n < 100; ++n) {
    motion_loops(p, target, 0.0, 24.0, s, orders);
  }
  const double error = nearest(0.01 * p.counts_per_rad) * p.rad_per_count;
  EXPECT_NEAR(s.omega_ref, p.angle_kp * error + 100 * p.angle_ki * p.T_m * error, 1e-9);
  settings.gains.angle_ki = 0;
  p = motion_params(d, settings);
  motion_loops(p, target, 0.0, 24.0, s, orders);
  EXPECT_NEAR(s.omega_ref, p.angle_kp * error, 1e-12);
}

TEST(IntegralGains, ZeroClearsTheCurrentIntegral) {
  DriveParams d = ideal_drive();
  d.mechanics.J = 1e3;  // locked
  ControlSettings settings = unlimited();
  DriveBank bank = one_drive(d, settings);
  bank.command(0, Torque{2.0});
  bank.advance(ticks_in(d, 0.1));
  EXPECT_NEAR(bank.truth(0).i_q, 2.0, 0.02);
  settings.gains.current_ki = 0;
  bank.configure(0, settings);
  bank.advance(ticks_in(d, 0.1));
  // v = K_p·(2 A − i) = R·i
  const double kp = current_loop_params(d, settings).kp_q;
  EXPECT_NEAR(bank.truth(0).i_q, 2.0 * kp / (kp + d.motor.R_s), 0.02);
}

}  // namespace control_test
}  // namespace lk::model::test
