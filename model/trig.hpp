#pragma once

/// @file Sine and cosine without libm, so that every machine and compiler gives the same bits.

#include "model/real.hpp"
#include "model/rounding.hpp"

namespace lk::model {
inline namespace LKEMU_ISA {

inline constexpr double kPi = 3.14159265358979323846;
inline constexpr double kTwoPi = 6.28318530717958647692;

template <class Real>
struct SinCos {
  Real sin, cos;
};

/// An angle as whole half turns and a rest x, |x| ≤ π/2. Each half turn negates sine and cosine.
template <class Real>
struct HalfTurn {
  Real x;
  Real turns;  // the last bit is the parity (see shifted_nearest)
};

template <class Real>
inline HalfTurn<Real> within_half_turn(const Real& theta) {
  const Real halves = theta * (2.0 / kTwoPi);
  const Real turns = shifted_nearest(halves);
  return {(halves - unshifted(turns)) * (kTwoPi / 2), turns};
}

/// sin x = x + x³·P(x²) for |x| ≤ π/2, P the minimax polynomial of degree 4: error < 2e-11.
template <class Real>
inline Real sine_series(const Real& x, const Real& x2, const Real& x4) {
  // Pairs of terms instead of Horner's scheme, so that the processor computes them in parallel.
  const Real tail =
      (-0.16666666606467134 + x2 * 0.008333330495676389) +
      x4 * ((-1.9840804039771915e-4 + x2 * 2.7522618881175285e-6) + x4 * -2.384669445306741e-8);
  return x + (x * x2) * tail;
}

/// cos x = 1 + x²·P(x²) for |x| ≤ π/2, P as above: error < 3e-10.
template <class Real>
inline Real cosine_series(const Real& x2, const Real& x4) {
  const Real tail =
      (-0.49999999549557234 + x2 * 0.041666640728057716) +
      x4 * ((-1.3888403508185373e-3 + x2 * 2.476188624661561e-5) + x4 * -2.607710532345082e-7);
  return 1.0 + x2 * tail;
}

/// Returns sin and cos of `theta` [rad], |theta| < 1e9. Absolute error < 3e-10 + |theta|·3e-16: far
/// below a ten-thousandth of one count of an 18-bit encoder.
template <class Real>
inline SinCos<Real> sincos(const Real& theta) {
  const HalfTurn<Real> part = within_half_turn(theta);
  const Real x2 = part.x * part.x;
  const Real x4 = x2 * x2;
  return {negate_if_odd(sine_series(part.x, x2, x4), part.turns),
          negate_if_odd(cosine_series(x2, x4), part.turns)};
}

/// Returns only the sine of `theta` [rad], at half the cost of sincos().
template <class Real>
inline Real sine(const Real& theta) {
  const HalfTurn<Real> part = within_half_turn(theta);
  const Real x2 = part.x * part.x;
  return negate_if_odd(sine_series(part.x, x2, Real(x2 * x2)), part.turns);
}

/// sin and cos of a small angle, |x| ≤ 0.5 rad: the turn of a rotor in half a period. Error < 2e-7
/// at 0.5 rad, 1e-13 at the 0.1 rad of ordinary speeds.
template <class Real>
inline SinCos<Real> sincos_small(const Real& x) {
  const Real x2 = x * x;
  return {x * (1.0 - x2 * (1.0 / 6 - x2 * (1.0 / 120 - x2 * (1.0 / 5040)))),
          1.0 - x2 * (0.5 - x2 * (1.0 / 24 - x2 * (1.0 / 720)))};
}

/// Returns exp(x) for −0.25 ≤ x ≤ 0.1. Remainder x⁷/7! < 2e-8 at the edge, 2e-11 at the −0.1 of
/// ordinary windings.
template <class Real>
inline Real exp_small(const Real& x) {
  const Real x2 = x * x;
  return (1.0 + x) +
         x2 * ((1.0 / 2 + x * (1.0 / 6)) + x2 * ((1.0 / 24 + x * (1.0 / 120)) + x2 * (1.0 / 720)));
}

/// Returns exp(x) for any x ≤ 0: halves x until the series holds, then squares the result back.
/// Avoids libm, because derived parameters need the same bits on every machine.
inline double exp_decay(double x) {
  int halvings = 0;
  while (x < -0.25 && halvings < 12) {
    x *= 0.5;
    ++halvings;
  }
  double result = x < -0.25 ? 0.0 : exp_small(x);
  for (; halvings > 0; --halvings) {
    result *= result;
  }
  return result;
}

}  // namespace LKEMU_ISA
}  // namespace lk::model
