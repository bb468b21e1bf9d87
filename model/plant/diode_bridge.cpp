#include "model/plant/diode_bridge.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace lk::model {
namespace {

using Phases = std::array<double, 3>;

constexpr int kSubsteps = 16;          // 2 µs at 32 kHz, far below any L/R
constexpr double kZeroCurrent = 1e-9;  // A, below it a phase does not conduct

/// The three phase axes as seen from the rotor.
std::array<SinCos<double>, 3> phase_axes(double theta_e) {
  const SinCos<double> a = sincos(theta_e);
  constexpr double kSin = 0.5 * kSqrt3;
  return {a, rotate(a, {-kSin, -0.5}), rotate(a, {kSin, -0.5})};
}

Phases to_phases(const Dq<double>& x, const std::array<SinCos<double>, 3>& axes) {
  Phases result{};
  for (std::size_t n = 0; n < 3; ++n) {
    result[n] = x.d * axes[n].cos - x.q * axes[n].sin;
  }
  return result;
}

Dq<double> to_dq(const Phases& x, const SinCos<double>& theta) {
  return park(clarke(Abc<double>{x[0], x[1], x[2]}), theta);
}

/// di_dq/dt for the phase voltages v.
Dq<double> slope(const DiodeBridgeInput& in, const Dq<double>& i, const Phases& v,
                 const SinCos<double>& theta) {
  const Dq<double> v_dq = to_dq(v, theta);
  return {(v_dq.d - in.R_s * i.d + in.omega_e * in.L_q * i.q) / in.L_d,
          (v_dq.q - in.R_s * i.q - in.omega_e * (in.L_d * i.d + in.psi_f)) / in.L_q};
}

/// d(i_n)/dt of one phase, the rotation of the axes included.
double phase_slope(const DiodeBridgeInput& in, const Dq<double>& i, const Phases& v,
                   const std::array<SinCos<double>, 3>& axes, std::size_t n) {
  const Dq<double> di = slope(in, i, v, axes[0]);
  return di.d * axes[n].cos - di.q * axes[n].sin -
         in.omega_e * (i.d * axes[n].sin + i.q * axes[n].cos);
}

/// +1: current into the motor, lower diode; −1: out of it, upper diode; 0: floating.
using Pattern = std::array<int, 3>;

double rail(const DiodeBridgeInput& in, int conducts) {
  return conducts > 0 ? -in.v_diode : in.v_link + in.v_diode;
}

/// The voltage at which a floating phase keeps its zero current: its slope is affine in it.
double floating_voltage(const DiodeBridgeInput& in, const Dq<double>& i, Phases v,
                        const std::array<SinCos<double>, 3>& axes, std::size_t n) {
  v[n] = 0.0;
  const double at_zero = phase_slope(in, i, v, axes, n);
  v[n] = 1.0;
  const double per_volt = phase_slope(in, i, v, axes, n) - at_zero;
  return -at_zero / per_volt;
}

Pattern conducting(const Phases& i) {
  Pattern pattern{};
  for (std::size_t n = 0; n < 3; ++n) {
    pattern[n] = i[n] > kZeroCurrent ? 1 : i[n] < -kZeroCurrent ? -1 : 0;
  }
  return pattern;
}

/// No current at all: the pair with the largest back-EMF starts if it exceeds the link.
Pattern rectifying(const DiodeBridgeInput& in, const std::array<SinCos<double>, 3>& axes) {
  const Phases emf = to_phases({0.0, in.omega_e * in.psi_f}, axes);
  const auto high =
      static_cast<std::size_t>(std::max_element(emf.begin(), emf.end()) - emf.begin());
  const auto low = static_cast<std::size_t>(std::min_element(emf.begin(), emf.end()) - emf.begin());
  Pattern pattern{};
  if (emf[high] - emf[low] > in.v_link + 2.0 * in.v_diode) {
    pattern[high] = -1;
    pattern[low] = 1;
  }
  return pattern;
}

/// Terminal voltages of a pattern; a floating phase pushed beyond a rail joins the pattern.
Phases terminal_voltages(const DiodeBridgeInput& in, const Dq<double>& i,
                         const std::array<SinCos<double>, 3>& axes, Pattern& pattern) {
  Phases v{};
  std::size_t floating = 3;
  for (std::size_t n = 0; n < 3; ++n) {
    if (pattern[n] == 0) {
      floating = n;
    } else {
      v[n] = rail(in, pattern[n]);
    }
  }
  if (floating < 3) {
    v[floating] = floating_voltage(in, i, v, axes, floating);
    if (v[floating] > in.v_link + in.v_diode) {
      pattern[floating] = -1;
      v[floating] = rail(in, -1);
    } else if (v[floating] < -in.v_diode) {
      pattern[floating] = 1;
      v[floating] = rail(in, 1);
    }
  }
  return v;
}

/// A phase whose current has reversed, or that floats, stays at zero; the others share the
/// remainder.
Phases without_reversals(Phases i, const Pattern& pattern) {
  for (std::size_t n = 0; n < 3; ++n) {
    if (i[n] * pattern[n] <= 0.0) {
      const std::size_t x = (n + 1) % 3;
      const std::size_t y = (n + 2) % 3;
      const double half = 0.5 * (i[x] - i[y]);
      i[n] = 0.0;
      i[x] = half;
      i[y] = -half;
      if (half * pattern[x] <= 0.0 || half * pattern[y] >= 0.0) {
        return {};
      }
    }
  }
  return i;
}

}  // namespace

WindingStep<double> diode_bridge(const DiodeBridgeInput& in) {
  constexpr double kShare = 1.0 / kSubsteps;
  const double dt = in.T_s * kShare;
  WindingStep<double> step{};
  Dq<double> i = in.i;
  for (int k = 0; k < kSubsteps; ++k) {
    const auto axes = phase_axes(in.theta_e + in.omega_e * dt * k);
    Pattern pattern = conducting(to_phases(i, axes));
    if (pattern == Pattern{}) {
      pattern = rectifying(in, axes);
      if (pattern == Pattern{}) {
        i = {0.0, 0.0};
        continue;
      }
    }
    const Phases v = terminal_voltages(in, i, axes, pattern);
    const Dq<double> k1 = slope(in, i, v, axes[0]);
    const Dq<double> middle{i.d + 0.5 * dt * k1.d, i.q + 0.5 * dt * k1.q};
    const auto axes_middle = phase_axes(in.theta_e + in.omega_e * dt * (k + 0.5));
    Pattern pattern_middle = pattern;
    const Phases v_middle = terminal_voltages(in, middle, axes_middle, pattern_middle);
    const Dq<double> k2 = slope(in, middle, v_middle, axes_middle[0]);

    const auto axes_end = phase_axes(in.theta_e + in.omega_e * dt * (k + 1));
    const Phases end =
        without_reversals(to_phases({i.d + dt * k2.d, i.q + dt * k2.q}, axes_end), pattern_middle);
    i = to_dq(end, axes_end[0]);

    const Phases flowing = to_phases(middle, axes_middle);
    for (std::size_t n = 0; n < 3; ++n) {
      step.i_link += pattern_middle[n] < 0 ? flowing[n] * kShare : 0.0;
      step.p_inverter += pattern_middle[n] != 0 ? in.v_diode * std::abs(flowing[n]) * kShare : 0.0;
    }
    step.i_mean.d += middle.d * kShare;
    step.i_mean.q += middle.q * kShare;
    step.mean_square += (middle.d * middle.d + middle.q * middle.q) * kShare;
    step.mean_dq += middle.d * middle.q * kShare;
  }
  step.i_next = i;
  return step;
}

}  // namespace lk::model
