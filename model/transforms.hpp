#pragma once

/// @file Amplitude-invariant Clarke and Park transforms. The d axis is that of the magnet flux.

#include "model/trig.hpp"

namespace lk::model {

template <class Real>
struct Abc {
  Real a, b, c;
};
template <class Real>
struct AlphaBeta {
  Real alpha, beta;
};
template <class Real>
struct Dq {
  Real d, q;
};

inline namespace LKEMU_ISA {

inline constexpr double kSqrt3 = 1.73205080756887729353;

/// α = (2a − b − c)/3, β = (b − c)/√3: the common mode drops out.
template <class Real>
inline AlphaBeta<Real> clarke(const Abc<Real>& x) {
  return {(2.0 * x.a - x.b - x.c) * (1.0 / 3), (x.b - x.c) * (1.0 / kSqrt3)};
}

/// a = α, b = −α/2 + √3/2·β, c = −α/2 − √3/2·β.
template <class Real>
inline Abc<Real> inverse_clarke(const AlphaBeta<Real>& x) {
  const Real half_alpha = 0.5 * x.alpha;
  const Real scaled_beta = (0.5 * kSqrt3) * x.beta;
  return {x.alpha, scaled_beta - half_alpha, -half_alpha - scaled_beta};
}

/// d = α·cos θ + β·sin θ, q = β·cos θ − α·sin θ.
template <class Real>
inline Dq<Real> park(const AlphaBeta<Real>& x, const SinCos<Real>& theta) {
  return {x.alpha * theta.cos + x.beta * theta.sin, x.beta * theta.cos - x.alpha * theta.sin};
}

template <class Real>
inline AlphaBeta<Real> inverse_park(const Dq<Real>& x, const SinCos<Real>& theta) {
  return {x.d * theta.cos - x.q * theta.sin, x.d * theta.sin + x.q * theta.cos};
}

/// Returns sin and cos of the sum of two angles.
template <class Real>
inline SinCos<Real> rotate(const SinCos<Real>& theta, const SinCos<Real>& by) {
  return {theta.sin * by.cos + theta.cos * by.sin, theta.cos * by.cos - theta.sin * by.sin};
}

}  // namespace LKEMU_ISA
}  // namespace lk::model
