#include "model/plant/leg_bridge.hpp"

#include <algorithm>
#include <cmath>

namespace lk::model {
namespace {

using Phases = std::array<double, 3>;

constexpr int kSubsteps = 16;          // 2 µs at 32 kHz, far below any L/R
constexpr double kZeroCurrent = 1e-9;  // A; up to this current, diodes do not conduct

/// Returns sin and cos of the angle from each phase axis to the rotor.
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

/// Returns di_dq/dt [A/s] for the phase voltages `v`.
Dq<double> slope(const LegBridgeInput& in, const Dq<double>& i, const Phases& v,
                 const SinCos<double>& theta) {
  const Dq<double> v_dq = to_dq(v, theta);
  return {(v_dq.d - in.R_s * i.d + in.omega_e * in.L_q * i.q) / in.L_d,
          (v_dq.q - in.R_s * i.q - in.omega_e * (in.L_d * i.d + in.psi_f)) / in.L_q};
}

/// Returns d(i_n)/dt [A/s] of phase n, including the rotation of the dq axes. The phase is a
/// template parameter, because indexed stores would add latency.
template <std::size_t n>
double phase_slope(const LegBridgeInput& in, const Dq<double>& i, const Phases& v,
                   const std::array<SinCos<double>, 3>& axes) {
  const Dq<double> di = slope(in, i, v, axes[0]);
  return di.d * axes[n].cos - di.q * axes[n].sin -
         in.omega_e * (i.d * axes[n].sin + i.q * axes[n].cos);
}

/// Returns the voltage of phase n at which its current stays zero. Solves for it exactly: the slope
/// of the current is an affine function of the voltage.
template <std::size_t n>
double floating_voltage(const LegBridgeInput& in, const Dq<double>& i, Phases v,
                        const std::array<SinCos<double>, 3>& axes) {
  v[n] = 0.0;
  const double at_zero = phase_slope<n>(in, i, v, axes);
  v[n] = 1.0;
  const double per_volt = phase_slope<n>(in, i, v, axes) - at_zero;
  return -at_zero / per_volt;
}

/// State of each leg: +1: current into the motor, −1: current out of the motor, 0: floating. Legs
/// of kSwitches are +1 at any current.
using Pattern = std::array<int, 3>;

Pattern conducting(const Legs& legs, const Phases& i, double i_zero = kZeroCurrent) {
  Pattern pattern{};
  for (std::size_t n = 0; n < 3; ++n) {
    switch (legs[n].kind) {
      case Leg::Kind::kOpen:
        break;
      case Leg::Kind::kDiodes:
        pattern[n] = i[n] > i_zero ? 1 : i[n] < -i_zero ? -1 : 0;
        break;
      case Leg::Kind::kSwitches:
        pattern[n] = 1;
        break;
    }
  }
  return pattern;
}

bool carries_current(const Pattern& pattern) { return std::ranges::count(pattern, 0) < 2; }

/// Voltage of a leg's terminal, and data for the losses of the leg.
struct Terminal {
  double v;      // V
  double share;  // of the leg's current that the link supplies
  double drop;   // V, besides R·i; the leg loses drop·i
};

Terminal terminal(const LegBridgeInput& in, const Leg& leg, double i, int pattern) {
  double share = pattern > 0 ? leg.share_in : leg.share_out;
  double drop = pattern > 0 ? leg.drop_in : -leg.drop_out;
  if (leg.kind == Leg::Kind::kSwitches) {
    const double s = std::clamp(i / in.i_zone, -1.0, 1.0);
    share = 0.5 * ((leg.share_in + leg.share_out) + s * (leg.share_in - leg.share_out));
    drop = s * leg.drop_in;
  }
  return {share * in.v_link - drop - leg.R * i, share, drop};
}

/// Returns the pattern for a motor without current: the pair of legs whose current the back-EMF
/// drives hardest conducts, if there is one.
Pattern starting(const LegBridgeInput& in, const Legs& legs,
                 const std::array<SinCos<double>, 3>& axes) {
  const Phases emf = to_phases({0.0, in.omega_e * in.psi_f}, axes);
  Pattern pattern = conducting(legs, {});
  double hardest = 0.0;
  for (std::size_t in_leg = 0; in_leg < 3; ++in_leg) {
    for (std::size_t out_leg = 0; out_leg < 3; ++out_leg) {
      if (in_leg == out_leg || legs[in_leg].kind == Leg::Kind::kOpen ||
          legs[out_leg].kind == Leg::Kind::kOpen) {
        continue;
      }
      const double against =
          terminal(in, legs[out_leg], 0.0, -1).v - terminal(in, legs[in_leg], 0.0, 1).v;
      const double drives = emf[out_leg] - emf[in_leg] - against;
      if (drives > hardest) {
        hardest = drives;
        pattern = conducting(legs, {});
        pattern[out_leg] = -1;
        pattern[in_leg] = 1;
      }
    }
  }
  return pattern;
}

using Terminals = std::array<Terminal, 3>;

Phases voltages(const Terminals& t) { return {t[0].v, t[1].v, t[2].v}; }

/// Sets the terminal of the floating phase n. If its voltage is beyond the blocking range of the
/// diodes, makes the phase conduct in `pattern`.
template <std::size_t n>
void float_phase(const LegBridgeInput& in, const Legs& legs, const Dq<double>& i,
                 const std::array<SinCos<double>, 3>& axes, Pattern& pattern, Terminals& result) {
  result[n].v = floating_voltage<n>(in, i, voltages(result), axes);
  if (legs[n].kind != Leg::Kind::kDiodes) {
    return;
  }
  for (const int direction : {-1, 1}) {
    const Terminal blocked = terminal(in, legs[n], 0.0, direction);
    if ((result[n].v - blocked.v) * direction < 0.0) {
      pattern[n] = direction;
      result[n] = blocked;
      break;
    }
  }
}

/// Returns the terminals of all phases. Makes a floating phase conduct in `pattern` where its
/// diodes no longer block. Pre: at most one phase floats.
Terminals terminals(const LegBridgeInput& in, const Legs& legs, const Dq<double>& i,
                    const std::array<SinCos<double>, 3>& axes, Pattern& pattern) {
  const Phases current = to_phases(i, axes);
  Terminals result{};
  for (std::size_t n = 0; n < 3; ++n) {
    if (pattern[n] != 0) {
      result[n] = terminal(in, legs[n], current[n], pattern[n]);
    }
  }
  if (pattern[0] == 0) {
    float_phase<0>(in, legs, i, axes, pattern, result);
  } else if (pattern[1] == 0) {
    float_phase<1>(in, legs, i, axes, pattern, result);
  } else if (pattern[2] == 0) {
    float_phase<2>(in, legs, i, axes, pattern, result);
  }
  return result;
}

/// Sets the current of a floating phase to zero, and the current of a phase whose diodes block the
/// new direction. The other two phases then carry opposite currents.
Phases without_reversals(Phases i, const Legs& legs, const Pattern& pattern) {
  const auto reversed = [&](std::size_t n, double current) {
    return legs[n].kind != Leg::Kind::kSwitches && current * pattern[n] <= 0.0;
  };
  for (std::size_t n = 0; n < 3; ++n) {
    if (reversed(n, i[n])) {
      const std::size_t x = (n + 1) % 3;
      const std::size_t y = (n + 2) % 3;
      const double half = 0.5 * (i[x] - i[y]);
      i[n] = 0.0;
      i[x] = half;
      i[y] = -half;
      if (reversed(x, half) || reversed(y, -half)) {
        return {};
      }
    }
  }
  return i;
}

double magnetic_energy(const LegBridgeInput& in, const Dq<double>& i) {
  return 0.75 * (in.L_d * i.d * i.d + in.L_q * i.q * i.q);
}

}  // namespace

Legs open_switches(double v_diode) {
  const Leg leg{Leg::Kind::kDiodes, 0.0, 1.0, v_diode, v_diode, 0.0};
  return {leg, leg, leg};
}

[[gnu::flatten]] LegBridgeStep leg_bridge(const LegBridgeInput& in, const Legs& legs) {
  constexpr double kShare = 1.0 / kSubsteps;
  const double dt = in.T_s * kShare;
  WindingStep<double> step{};
  double cut = 0.0;          // J
  double p_backwards = 0.0;  // W, negative losses of diodes in steps where their current reverses
  Dq<double> i = in.i;
  auto axes_end = phase_axes(in.theta_e);
  for (int k = 0; k < kSubsteps; ++k) {
    const auto axes = axes_end;
    axes_end = phase_axes(in.theta_e + in.omega_e * dt * (k + 1));
    const double slack = k == 0 ? in.slack * (std::abs(i.d) + std::abs(i.q)) : 0.0;
    Pattern pattern = conducting(legs, to_phases(i, axes), kZeroCurrent + slack);
    if (!carries_current(pattern)) {
      cut += magnetic_energy(in, i);
      i = {0.0, 0.0};
      pattern = starting(in, legs, axes);
      if (!carries_current(pattern)) {
        continue;
      }
    }
    const Terminals t = terminals(in, legs, i, axes, pattern);
    const Dq<double> k1 = slope(in, i, voltages(t), axes[0]);
    const Dq<double> middle{i.d + 0.5 * dt * k1.d, i.q + 0.5 * dt * k1.q};
    const auto axes_middle = phase_axes(in.theta_e + in.omega_e * dt * (k + 0.5));
    Pattern pattern_middle = pattern;
    const Terminals t_middle = terminals(in, legs, middle, axes_middle, pattern_middle);
    const Dq<double> k2 = slope(in, middle, voltages(t_middle), axes_middle[0]);

    const Dq<double> free_end{i.d + dt * k2.d, i.q + dt * k2.q};
    const Phases end = without_reversals(to_phases(free_end, axes_end), legs, pattern_middle);
    i = to_dq(end, axes_end[0]);
    cut += magnetic_energy(in, free_end) - magnetic_energy(in, i);

    const Phases flowing = to_phases(middle, axes_middle);
    for (std::size_t n = 0; n < 3; ++n) {
      const double lost = t_middle[n].drop * flowing[n];
      step.i_link += t_middle[n].share * flowing[n] * kShare;
      step.p_inverter += (std::abs(lost) + legs[n].R * flowing[n] * flowing[n]) * kShare;
      p_backwards += (lost - std::abs(lost)) * kShare;
    }
    step.i_mean.d += middle.d * kShare;
    step.i_mean.q += middle.q * kShare;
    step.mean_square += (middle.d * middle.d + middle.q * middle.q) * kShare;
    step.mean_dq += middle.d * middle.q * kShare;
  }
  step.i_next = i;
  return {step, cut / in.T_s + p_backwards};
}

}  // namespace lk::model
