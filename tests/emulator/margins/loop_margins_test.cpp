// Compares the linearised loops with the simulated ones.
#include "emulator/io/program/loop_margins.hpp"

#include <cmath>
#include <numbers>

#include "model/control/motion_loops.hpp"
#include "tests/model/profiles.hpp"

namespace lk::emulator {
namespace loop_margins_test {

using Complex = std::complex<double>;
using model::test::NamedDrive;

/// A motor without nonlinear effects: no friction, cogging, play, noise or dead time, and fine
/// encoder counts.
model::DriveInit linear_drive(const std::string& name, double rotors) {
  for (const NamedDrive& named : model::test::all_profiles()) {
    if (named.name != name) continue;
    model::DriveInit init = named.init;
    model::DriveParams& d = init.params;
    model::MechanicsParams& m = d.mechanics;
    m.tau_coulomb = m.tau_static = m.tau_coulomb_out = m.tau_cogging = m.backlash_out = 0.0;
    m.gear_efficiency = 1.0;
    d.inverter.t_dead = 0.0;
    d.encoder.bits = 18;
    d.encoder.noise = d.encoder.inl_1 = d.encoder.inl_2 = d.current_sensor.noise = 0.0;
    d.current_sensor.offset_a = d.current_sensor.offset_b = 0.0;
    d.load.J = rotors * m.J * m.gear_ratio * m.gear_ratio;
    return init;
  }
  ADD_FAILURE() << name;
  return {};
}

/// Returns the loop's measured speed over the commanded speed at `omega`: from a setpoint
/// oscillation about 20 rad/s, over whole periods, after settling.
Complex simulated(const model::DriveInit& init, double omega) {
  const model::MotionParams p = model::motion_params(init.params, init.settings);
  // A whole number of samples per period avoids leakage.
  const auto samples = static_cast<int>(std::lround(2 * std::numbers::pi / (omega * p.T_m)));
  const double step = 2 * std::numbers::pi / samples;
  model::DriveBank bank(std::span(&init, 1));
  const auto settling = static_cast<int>(1.5 / p.T_m) / samples + 1;
  const int periods = std::max(1, 4000 / samples);
  constexpr double kBias = 20.0;  // rad/s
  constexpr double kSwing = 1.0;  // rad/s
  Complex commanded, angle;
  for (int n = 0; n < (settling + periods) * samples; ++n) {
    const double swing = kSwing * std::sin(step * n);
    if (n >= settling * samples) {
      const Complex turn = std::polar(1.0, -step * n);
      commanded += swing * turn;
      angle += (bank.truth(0).theta_m - kBias * n * p.T_m) * turn;
    }
    bank.command(0, model::Speed{kBias + swing});
    bank.advance(init.params.control.motion_divider);
  }
  // Speed as the estimator computes it (docs/internals/model.md §11), from a reading one PWM period
  // old.
  const Complex z1 = std::polar(1.0, -step);
  const Complex estimate =
      p.estimator_share * (1.0 - z1) / p.T_m / (1.0 - (1.0 - p.estimator_share) * z1);
  const Complex reading = std::polar(1.0, -step / p.T_m / init.params.inverter.f_pwm);
  return angle / commanded * estimate * reading;
}

TEST(OpenLoop, MatchesTheSimulatedFrequencyResponse) {
  struct Bench {
    const char* motor;
    double rotors;
  };
  for (const Bench& bench : {Bench{"mf7015", 0}, Bench{"mf7015", 10}, Bench{"mg4005", 0},
                             Bench{"mg4005", 10}, Bench{"mg8016", 3}}) {
    const model::DriveInit init = linear_drive(bench.motor, bench.rotors);
    const double T_m = init.params.control.motion_divider / init.params.inverter.f_pwm;
    for (const int samples : {1600, 400, 160, 80, 40, 32, 20}) {
      const double omega = 2 * std::numbers::pi / (samples * T_m);
      const Complex open = open_loop(init.params, init.settings, Loop::kSpeed, omega);
      const Complex expected = open / (1.0 + open);
      const Complex seen = simulated(init, omega);
      SCOPED_TRACE(std::string(bench.motor) + ", rad/s: " + std::to_string(omega));
      // The linearisation models the current loop as continuous with a delay; its error grows with
      // the frequency.
      EXPECT_NEAR(std::abs(seen / expected), 1.0, 0.03);
      EXPECT_NEAR(std::arg(seen / expected) * 180 / std::numbers::pi, 0.0, 1.5);
    }
  }
}

/// Returns the rotor speed one second after a target step, relative to that in the first tenth.
double remaining_oscillation(model::DriveInit init) {
  model::DriveBank bank(std::span(&init, 1));
  const auto f = static_cast<std::int64_t>(init.params.inverter.f_pwm);
  bank.command(0, model::Position{0.2});
  const auto most = [&](std::int64_t ticks) {
    double omega = 0;
    for (std::int64_t n = 0; n < ticks; n += 32) {
      bank.advance(32);
      omega = std::max(omega, std::abs(bank.truth(0).omega_m));
    }
    return omega;
  };
  const double first = most(f / 10);
  most(19 * f / 10);
  return most(f / 2) / first;
}

TEST(Margins, NegativeMarginsOscillate) {
  for (const double rotors : {10.0, 30.0, 35.0, 45.0, 60.0}) {
    const model::DriveInit init = linear_drive("mf7015", rotors);
    const Margins m = loop_margins(init.params, init.settings, Loop::kPosition);
    SCOPED_TRACE(std::to_string(rotors) + " rotors, " + std::to_string(m.gain_dB) + " dB");
    EXPECT_EQ(m.gain_dB < 0, m.phase_deg < 0);
    EXPECT_EQ(m.gain_dB<0, remaining_oscillation(init)> 0.5);
  }
}

/// With a heavier load the integrators need more gain, and the gain margin is that factor. Speed
/// gains raised by it put the loop at its limit.
TEST(Margins, GainMarginIsTheFactorToTheLimit) {
  const model::DriveInit init = linear_drive("mf7015", 60);
  const Margins m = loop_margins(init.params, init.settings, Loop::kPosition);
  ASSERT_LT(m.gain_dB, 0);
  model::DriveInit more = init;
  more.params.control.speed_bandwidth *= std::pow(10.0, -m.gain_dB / 20);
  const Margins limit = loop_margins(more.params, more.settings, Loop::kPosition);
  EXPECT_NEAR(limit.gain_dB, 0, 0.05);
  EXPECT_NEAR(limit.phase_deg, 0, 0.5);
}

/// Up to the loads for which vendors sell such motors.
TEST(Margins, FactoryGainsHaveMarginUpToTenRotors) {
  for (const NamedDrive& named : model::test::all_profiles()) {
    for (const double rotors : {0.0, 1.0, 3.0, 10.0}) {
      model::DriveParams d = named.init.params;
      d.load.J = rotors * d.mechanics.J * d.mechanics.gear_ratio * d.mechanics.gear_ratio;
      for (const Loop loop : {Loop::kSpeed, Loop::kPosition}) {
        const Margins m = loop_margins(d, named.init.settings, loop);
        SCOPED_TRACE(named.name + ", rotors: " + std::to_string(rotors));
        EXPECT_GT(m.gain_dB, 0);
        EXPECT_GT(m.phase_deg, 0);
        // The drive of this log was observed to ring.
        if (named.name != "mg4005-14p") {
          EXPECT_FALSE(is_ringing(m)) << m.gain_dB << " dB, " << m.phase_deg << " deg";
        }
      }
    }
  }
}

}  // namespace loop_margins_test
}  // namespace lk::emulator
