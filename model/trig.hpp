#pragma once

/// @file Sine and cosine without libm, so that every machine and compiler gives the same bits.

#include "model/real.hpp"

namespace lk::model {
inline namespace LKEMU_ISA {

inline constexpr double kPi = 3.14159265358979323846;
inline constexpr double kTwoPi = 6.28318530717958647692;

template <class Real>
struct SinCos {
  Real sin, cos;
};

/// Taylor polynomials of sin and cos for |x| ≤ π/4; remainders x¹¹/11! = 1.8e-9 and x¹²/12!
/// = 1.1e-10: a ten-thousandth of one count of an 18-bit encoder.
template <class Real>
inline SinCos<Real> sincos_octant(const Real& x) {
  const Real x2 = x * x;
  const Real x4 = x2 * x2;
  // Pairs instead of Horner's chain: the halves of a polynomial do not wait for each other.
  const Real sin_tail =
      x2 * ((-1.0 / 6 + x2 * (1.0 / 120)) + x4 * (-1.0 / 5040 + x2 * (1.0 / 362880)));
  const Real cos_tail = x2 * ((-0.5 + x2 * (1.0 / 24)) +
                              x4 * ((-1.0 / 720 + x2 * (1.0 / 40320)) + x4 * (-1.0 / 3628800)));
  return {x + x * sin_tail, 1.0 + cos_tail};
}

/// sin and cos of `theta` [rad], |theta| < 1e9; absolute error < 2e-9 + |theta|·1e-16.
template <class Real>
inline SinCos<Real> sincos(const Real& theta) {
  const Real quarters = theta * (4.0 / kTwoPi);
  const Real whole = nearest(quarters);
  const SinCos<Real> octant = sincos_octant((quarters - whole) * (kTwoPi / 4));
  const Real quadrant = whole - 4.0 * nearest<Real>(whole * 0.25);  // −2, −1, 0, 1 or 2
  const auto odd = abs(quadrant) == 1.0;
  const auto half = abs(quadrant) == 2.0;
  const Real sin = select(odd, octant.cos, octant.sin);
  const Real cos = select(odd, octant.sin, octant.cos);
  return {select(half || quadrant == -1.0, -sin, sin), select(half || quadrant == 1.0, -cos, cos)};
}

/// sin of `theta` [rad] alone, at half the price: reduced to |x| ≤ π/2; remainder x¹⁵/15! = 7e-10.
template <class Real>
inline Real sine(const Real& theta) {
  const Real halves = theta * (2.0 / kTwoPi);
  const Real whole = nearest(halves);
  const Real x = (halves - whole) * (kTwoPi / 2);
  const Real x2 = x * x;
  const Real x4 = x2 * x2;
  const Real tail = x2 * ((-1.0 / 6 + x2 * (1.0 / 120)) +
                          x4 * ((-1.0 / 5040 + x2 * (1.0 / 362880)) +
                                x4 * (-1.0 / 39916800 + x2 * (1.0 / 6227020800.0))));
  const Real odd = whole - 2.0 * nearest<Real>(whole * 0.5);  // −1, 0 or 1
  const Real sin = x + x * tail;
  return select(odd == 0.0, sin, -sin);
}

/// sin and cos of a small angle, |x| ≤ 0.5 rad: what a rotor turns in half a period (error < 2e-7
/// there, 1e-13 at the 0.1 rad of ordinary speeds).
template <class Real>
inline SinCos<Real> sincos_small(const Real& x) {
  const Real x2 = x * x;
  return {x * (1.0 - x2 * (1.0 / 6 - x2 * (1.0 / 120 - x2 * (1.0 / 5040)))),
          1.0 - x2 * (0.5 - x2 * (1.0 / 24 - x2 * (1.0 / 720)))};
}

/// exp(x) for −0.25 ≤ x ≤ 0.1; remainder x⁷/7! < 2e-8 at the edge, 2e-11 at the −0.1 of ordinary
/// windings.
template <class Real>
inline Real exp_small(const Real& x) {
  const Real x2 = x * x;
  return (1.0 + x) +
         x2 * ((1.0 / 2 + x * (1.0 / 6)) + x2 * ((1.0 / 24 + x * (1.0 / 120)) + x2 * (1.0 / 720)));
}

}  // namespace LKEMU_ISA
}  // namespace lk::model
