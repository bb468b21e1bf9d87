#pragma once

/// @file Rounds doubles and finds the parity of integers, by operations on their bits.

#include "model/real.hpp"

namespace lk::model {
inline namespace LKEMU_ISA {

/// Returns the nearest integer plus 1.5·2^52, ties to even, for |x| < 2^51. The addition drops
/// exactly the fraction bits, so that the last bit is the parity of the integer.
template <class Real>
inline Real shifted_nearest(const Real& x) {
  return x + 0x1.8p52;
}
template <class Real>
inline Real unshifted(const Real& x) {
  return x - 0x1.8p52;
}
/// Nearest integer, ties to even, for |x| < 2^51.
template <class Real>
inline Real nearest(const Real& x) {
  return unshifted(shifted_nearest(x));
}
/// Largest integer not above x, for |x| < 2^51.
template <class Real>
inline Real floored(const Real& x) {
  const Real integer = nearest(x);
  return select(x < integer, integer - 1.0, integer);
}

// Reinterpret bits as numbers, and numbers as bits.
inline double as_number(std::uint64_t bits) { return std::bit_cast<double>(bits); }
template <class Abi>
inline auto as_number(const stdx::simd<std::uint64_t, Abi>& bits) {
  using Number = stdx::rebind_simd_t<double, stdx::simd<std::uint64_t, Abi>>;
  return std::bit_cast<Number>(bits);
}
inline std::uint64_t as_bits(double x) { return std::bit_cast<std::uint64_t>(x); }
template <class Abi>
inline auto as_bits(const Simd<Abi>& x) {
  return std::bit_cast<stdx::rebind_simd_t<std::uint64_t, Simd<Abi>>>(x);
}

/// Returns −x if `n` is odd, else x: the last bit of `n` flips the sign. `n`: a shifted_nearest().
template <class Real>
inline Real negate_if_odd(const Real& x, const Real& n) {
  return as_number(as_bits(x) ^ (as_bits(n) << 63));
}
inline Pair negate_if_odd(const Pair& x, const Pair& n) {
  return {negate_if_odd(x.low, n.low), negate_if_odd(x.high, n.high)};
}

}  // namespace LKEMU_ISA
}  // namespace lk::model
