#pragma once

/// @file The number type of the fast tick: one drive (`double`) or several drives in vector
/// registers (`Lanes`).
///
/// All code of the tick is a template over `Real`. Only the functions in this file differ by type.
/// All types do the same IEEE operations in the same order. So the results of a drive have the same
/// bits alone or in a lane.
///
/// LKEMU_ISA names an inline namespace for each instruction set. It keeps the linker from merging
/// functions that were compiled for different instruction sets.

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "model/simd.hpp"

#ifndef LKEMU_ISA
#define LKEMU_ISA isa_generic
#endif

namespace lk::model {

inline constexpr std::size_t kLanes = 8;

/// Storage of one quantity of eight drives; the same layout for every instruction set.
struct alignas(64) Wide {
  std::array<double, kLanes> lane{};
};

inline namespace LKEMU_ISA {

using Vector = stdx::native_simd<double>;
/// 64-bit words in a register of the same size, for noise generators and the bits of doubles.
using Words = stdx::rebind_simd_t<std::uint64_t, Vector>;
static_assert(Words::size() == Vector::size());

/// Two vector registers. The tick is a long chain of dependent operations; work on the second
/// register fills the latency of the first.
struct Pair {
  struct Mask {
    Vector::mask_type low, high;
    bool operator[](std::size_t lane) const {
      return lane < Vector::size() ? low[lane] : high[lane - Vector::size()];
    }
    friend Mask operator&&(const Mask& a, const Mask& b) {
      return {a.low && b.low, a.high && b.high};
    }
    friend Mask operator||(const Mask& a, const Mask& b) {
      return {a.low || b.low, a.high || b.high};
    }
  };
  using mask_type = Mask;

  Vector low, high;

  Pair() {}  // NOLINT(modernize-use-equals-default): `{}` must not write zeros, as that takes time
  Pair(double x) : low(x), high(x) {}  // NOLINT(google-explicit-constructor): for 2.0 * pair
  Pair(const Vector& l, const Vector& h) : low(l), high(h) {}

  static constexpr std::size_t size() { return 2 * Vector::size(); }
  double operator[](std::size_t lane) const {
    return lane < Vector::size() ? low[lane] : high[lane - Vector::size()];
  }
  void copy_from(const double* from, stdx::vector_aligned_tag tag) {
    low.copy_from(from, tag);
    high.copy_from(from + Vector::size(), tag);
  }
  void copy_to(double* to, stdx::vector_aligned_tag tag) const {
    low.copy_to(to, tag);
    high.copy_to(to + Vector::size(), tag);
  }

  Pair& operator+=(const Pair& b) { return *this = *this + b; }
  friend Pair operator-(const Pair& a) { return {-a.low, -a.high}; }
  friend Pair operator+(const Pair& a, const Pair& b) { return {a.low + b.low, a.high + b.high}; }
  friend Pair operator-(const Pair& a, const Pair& b) { return {a.low - b.low, a.high - b.high}; }
  friend Pair operator*(const Pair& a, const Pair& b) { return {a.low * b.low, a.high * b.high}; }
  friend Pair operator/(const Pair& a, const Pair& b) { return {a.low / b.low, a.high / b.high}; }
  friend Mask operator<(const Pair& a, const Pair& b) { return {a.low < b.low, a.high < b.high}; }
  friend Mask operator>(const Pair& a, const Pair& b) { return {a.low > b.low, a.high > b.high}; }
  friend Mask operator==(const Pair& a, const Pair& b) {
    return {a.low == b.low, a.high == b.high};
  }
  friend Mask operator!=(const Pair& a, const Pair& b) {
    return {a.low != b.low, a.high != b.high};
  }
};

template <class Abi>
using Simd = stdx::simd<double, Abi>;
template <class Abi>
using SimdMask = stdx::simd_mask<double, Abi>;

template <class Abi>
inline Simd<Abi> select(const SimdMask<Abi>& mask, const Simd<Abi>& a, const Simd<Abi>& b) {
#if defined(__clang__) && defined(__AVX512F__)
  // Not by `where`: libstdc++ would treat the mask as one bool (simd_x86.h: "a boolean choice, not
  // a blend").
  return Simd<Abi>([&](std::size_t lane) { return mask[lane] ? a[lane] : b[lane]; });
#else
  Simd<Abi> result = b;
  stdx::where(mask, result) = a;
  return result;
#endif
}
inline Pair select(const Pair::Mask& mask, const Pair& a, const Pair& b) {
  return {select(mask.low, a.low, b.low), select(mask.high, a.high, b.high)};
}
template <class Abi>
inline bool any(const SimdMask<Abi>& mask) {
  return stdx::any_of(mask);
}
inline bool any(const Pair::Mask& mask) { return any(mask.low || mask.high); }
template <class Abi>
inline Simd<Abi> sqrt(const Simd<Abi>& x) {
  return stdx::sqrt(x);
}
inline Pair sqrt(const Pair& x) { return {sqrt(x.low), sqrt(x.high)}; }
template <class Abi>
inline Simd<Abi> abs(const Simd<Abi>& x) {
  return stdx::abs(x);
}
inline Pair abs(const Pair& x) { return {abs(x.low), abs(x.high)}; }

/// Number type of the lane kernels: a pair, or one register if it holds a whole block.
using Lanes = std::conditional_t<Vector::size() < kLanes, Pair, Vector>;
static_assert(kLanes % Lanes::size() == 0);

/// Number type of a single drive: a register with the same number twice. A select in a register
/// needs no branch. With `double` there would be branches that depend on sensor noise, and half of
/// them would be mispredicted.
using Solo = Simd<stdx::simd_abi::deduce_t<double, 2>>;
static_assert(!std::is_same_v<Solo, Lanes>);

inline double select(bool mask, double a, double b) { return mask ? a : b; }
inline bool any(bool mask) { return mask; }
inline double sqrt(double x) { return std::sqrt(x); }
inline double abs(double x) { return std::abs(x); }

// If both arguments are equal, min and max return the same argument as min and max of stdx, which
// argument-dependent look-up selects for lanes.
inline double min(double a, double b) { return a < b ? a : b; }
inline double max(double a, double b) { return a > b ? a : b; }
inline double clamp(double x, double low, double high) { return min(high, max(low, x)); }
template <class Abi>
inline Simd<Abi> min(const Simd<Abi>& a, const Simd<Abi>& b) {
  return stdx::min(a, b);
}
template <class Abi>
inline Simd<Abi> max(const Simd<Abi>& a, const Simd<Abi>& b) {
  return stdx::max(a, b);
}
inline Pair min(const Pair& a, const Pair& b) { return {min(a.low, b.low), min(a.high, b.high)}; }
inline Pair max(const Pair& a, const Pair& b) { return {max(a.low, b.low), max(a.high, b.high)}; }
inline Pair clamp(const Pair& x, const Pair& low, const Pair& high) {
  return min(high, max(low, x));
}
template <class Abi>
inline Simd<Abi> clamp(const Simd<Abi>& x, const Simd<Abi>& low, const Simd<Abi>& high) {
  return min(high, max(low, x));
}

/// Returns select(mask, a, b) if `can`, else `b` without any computation. `can` is false if no
/// drive in this build of the tick can set the mask.
template <bool can, class Mask, class Real>
inline Real select_if(const Mask& mask, const Real& a, const Real& b) {
  if constexpr (can) {
    return select(mask, a, b);
  } else {
    return b;
  }
}
}  // namespace LKEMU_ISA

}  // namespace lk::model
