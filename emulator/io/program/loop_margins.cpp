#include "emulator/io/program/loop_margins.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "model/control/current_loop.hpp"
#include "model/control/current_loop_params.hpp"
#include "model/control/motion_loops.hpp"

namespace lk::emulator {
namespace {

using Complex = std::complex<double>;
constexpr double kPi = std::numbers::pi;

/// Returns rotor angle per torque at `s`, rad/Nm: of one inertia, or of two with a spring between
/// them.
///   J·θ̈ = τ − B·θ̇ − τ_g/N,  J_out·θ̈_out = τ_g,  τ_g = k·(θ/N − θ_out) + d·(θ̇/N − θ̇_out)
Complex angle_per_torque(const model::DriveParams& drive, Complex s) {
  const model::MechanicsParams& m = drive.mechanics;
  const double N = m.gear_ratio;
  const double J_out = m.J_out + drive.load.J;
  if (m.gear_stiffness_out <= 0.0) {
    return 1.0 / (s * ((m.J + J_out / (N * N)) * s + m.B));
  }
  Eigen::Matrix4d A;  // state: θ, θ_out, ω, ω_out
  const double k = m.gear_stiffness_out;
  const double d = m.gear_damping_out;
  A << 0, 0, 1, 0,  //
      0, 0, 0, 1,   //
      -k / (N * N * m.J), k / (N * m.J), -(m.B + d / (N * N)) / m.J, d / (N * m.J), k / (N * J_out),
      -k / J_out, d / (N * J_out), -d / J_out;
  const Eigen::Vector4d B(0, 0, 1.0 / m.J, 0);
  const Eigen::Matrix4cd sI_A = s * Eigen::Matrix4cd::Identity() - A.cast<Complex>();
  return sI_A.partialPivLu().solve(B.cast<Complex>())(0);
}

/// Frequency response of the current to its reference, A/A, and to a voltage in the winding, A/V.
/// With a current loop: the closed loop of model.md §10, with its delay of 1.5 periods. In voltage
/// mode: the winding without feedback. In both, a reference takes effect one period late.
struct CurrentLoop {
  Complex per_reference, per_voltage;
};
CurrentLoop current_loop(const model::DriveParams& drive, const model::ControlSettings& settings,
                         Complex s) {
  const double T_s = 1.0 / drive.inverter.f_pwm;
  const double R = drive.motor.R_s + drive.inverter.R_on;
  const Complex winding = 1.0 / (drive.motor.L_q * s + R);
  // Delay of one period until a reference takes effect; `open_loop` adds that of the hold.
  const Complex late = std::exp(-T_s * s);
  if (!drive.control.has_current_loop) {
    return {drive.motor.R_s * winding * late, winding};
  }
  const auto p = model::current_loop_params(drive, settings);
  const Complex controller = p.kp_q + p.ki_T / (T_s * s);
  const Complex closed = winding / (1.0 + controller * winding * std::exp(-1.5 * T_s * s));
  return {closed * controller * late, closed};
}

struct Point {
  double omega;
  Complex open;
};

/// Resolves the resonance of a gear with a damping of a few percent.
constexpr int kPointsPerDecade = 400;

double gain_dB(const Complex& open) { return 20.0 * std::log10(std::abs(open)); }
/// Phase relative to −1, in (−180, 180].
double phase_deg(const Complex& open) { return std::arg(-open) * 180.0 / kPi; }

/// Interpolates between `at_before` and `at_after` to the zero between `before` and `after`.
double between(double before, double after, double at_before, double at_after) {
  return at_before + (at_after - at_before) * before / (before - after);
}

}  // namespace

Complex open_loop(const model::DriveParams& drive, const model::ControlSettings& settings,
                  Loop loop, double omega) {
  const model::MotionParams p = model::motion_params(drive, settings);
  const double p_psi = drive.motor.pole_pairs * drive.motor.psi_f;
  const double T_s = 1.0 / drive.inverter.f_pwm;
  const Complex s(0.0, omega);
  const Complex z1 = std::exp(-s * p.T_m);  // delay of one period of the motion loops
  const Complex estimate =
      p.estimator_share * (1.0 - z1) / p.T_m / (1.0 - (1.0 - p.estimator_share) * z1);
  // Hold for one period of the motion loops, and the encoder's delay: it is read one PWM period
  // before the loops run.
  const Complex held = (1.0 - z1) / (s * p.T_m) * std::exp(-s * T_s);

  const CurrentLoop current = current_loop(drive, settings, s);
  const Complex per_current = 1.5 * p_psi * angle_per_torque(drive, s);
  // Back-EMF minus its compensation by the firmware. The delay of the compensation acts as an added
  // inertia.
  const Complex emf = p_psi * (s - drive.control.emf_share * estimate * held * std::exp(-s * T_s));
  const Complex angle =
      held * per_current * current.per_reference / (1.0 + per_current * current.per_voltage * emf);

  const Complex speed_pi = p.speed_kp + p.speed_ki * p.T_m * z1 / (1.0 - z1);
  const double angle_kp = loop == Loop::kPosition ? p.angle_kp : 0.0;
  return angle * speed_pi * (estimate + angle_kp);
}

Margins loop_margins(const model::DriveParams& drive, const model::ControlSettings& settings,
                     Loop loop) {
  const double omega_most = kPi * drive.inverter.f_pwm / drive.control.motion_divider;
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Margins margins{kInfinity, kInfinity};
  double turned = 0.0;  // rad; turn of 1 + L from the lowest frequency to half the sampling rate
  Point before{0.1, open_loop(drive, settings, loop, 0.1)};
  const double step = std::pow(10.0, 1.0 / kPointsPerDecade);
  for (double omega = before.omega * step; omega < omega_most; omega *= step) {
    const Point here{omega, open_loop(drive, settings, loop, omega)};
    turned += std::arg((1.0 + here.open) / (1.0 + before.open));
    const double gain[] = {gain_dB(before.open), gain_dB(here.open)};
    const double phase[] = {phase_deg(before.open), phase_deg(here.open)};
    if (gain[0] * gain[1] <= 0.0) {
      margins.phase_deg =
          std::min(margins.phase_deg, std::abs(between(gain[0], gain[1], phase[0], phase[1])));
    }
    // The phase crosses −180°. At 0° this phase jumps by 360°, which does not count.
    if (phase[0] * phase[1] <= 0.0 && std::abs(phase[0] - phase[1]) < 180.0) {
      margins.gain_dB =
          std::min(margins.gain_dB, std::abs(between(phase[0], phase[1], gain[0], gain[1])));
    }
    before = here;
  }
  // Nyquist: with up to three integrators, 1 + L of a stable loop turns by +90° to +270° and ends
  // at 0°. Each pair of unstable poles reduces this by 360°, so the turn is negative.
  if (turned < 0.0) margins = {-margins.gain_dB, -margins.phase_deg};
  return margins;
}

}  // namespace lk::emulator
