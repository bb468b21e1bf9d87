#pragma once

/// @file The number type of the fast tick: one drive (`double`) or eight drives side by side
/// (`Lanes`).
///
/// Everything the tick computes is written once over `Real`. The functions here are the only place
/// that knows there are two of them; both do the same IEEE operations in the same order, so a drive
/// gives the same bits whether it runs alone or in a lane.
///
/// LKEMU_ISA names an inline namespace: lane kernels are compiled for several instruction sets, and
/// the linker must never merge a function built for one with that of another.

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <experimental/simd>

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

/// As many doubles as one vector register of this instruction set holds (2, 4 or 8): the tick runs
/// over a block of kLanes drives in kLanes / size passes.
using Lanes = std::experimental::native_simd<double>;
static_assert(kLanes % Lanes::size() == 0);

inline Lanes select(const Lanes::mask_type& mask, const Lanes& a, const Lanes& b) {
  Lanes result = b;
  std::experimental::where(mask, result) = a;
  return result;
}
inline bool any(const Lanes::mask_type& mask) { return std::experimental::any_of(mask); }
inline Lanes sqrt(const Lanes& x) { return std::experimental::sqrt(x); }
inline Lanes abs(const Lanes& x) { return std::experimental::abs(x); }

inline double select(bool mask, double a, double b) { return mask ? a : b; }
inline bool any(bool mask) { return mask; }
inline double sqrt(double x) { return std::sqrt(x); }
inline double abs(double x) { return std::abs(x); }

// The same choice between equal arguments as std::experimental's, which argument-dependent look-up
// prefers for lanes.
inline double min(double a, double b) { return a < b ? a : b; }
inline double max(double a, double b) { return a > b ? a : b; }
inline double clamp(double x, double low, double high) { return min(high, max(low, x)); }
inline Lanes min(const Lanes& a, const Lanes& b) { return std::experimental::min(a, b); }
inline Lanes max(const Lanes& a, const Lanes& b) { return std::experimental::max(a, b); }
inline Lanes clamp(const Lanes& x, const Lanes& low, const Lanes& high) {
  return min(high, max(low, x));
}

/// Nearest integer, ties to even, for |x| < 2^51: the sum loses exactly the fraction bits.
template <class Real>
inline Real nearest(const Real& x) {
  return (x + 0x1.8p52) - 0x1.8p52;
}
/// Largest integer not above x, for |x| < 2^51.
template <class Real>
inline Real floored(const Real& x) {
  const Real integer = nearest(x);
  return select(x < integer, integer - 1.0, integer);
}

template <class Real>
inline constexpr std::size_t kSizeOf = Real::size();
template <>
inline constexpr std::size_t kSizeOf<double> = 1;

// A `Real` from its stored form and back, beginning at drive `first` of the block.
inline void load(double& value, const double& stored, std::size_t /*first*/) { value = stored; }
inline void load(Lanes& value, const Wide& stored, std::size_t first) {
  value.copy_from(stored.lane.data() + first, std::experimental::vector_aligned);
}
inline void store(double value, double& stored, std::size_t /*first*/) { stored = value; }
inline void store(const Lanes& value, Wide& stored, std::size_t first) {
  value.copy_to(stored.lane.data() + first, std::experimental::vector_aligned);
}

}  // namespace LKEMU_ISA

/// How a `Real` is kept between ticks.
template <class Real>
struct Storage {
  using type = Wide;
};
template <>
struct Storage<double> {
  using type = double;
};

// One drive's value in stored form.
inline double& lane_of(double& stored, std::size_t /*lane*/) { return stored; }
inline double& lane_of(Wide& stored, std::size_t lane) { return stored.lane[lane]; }
inline double lane_of(const double& stored, std::size_t /*lane*/) { return stored; }
inline double lane_of(const Wide& stored, std::size_t lane) { return stored.lane[lane]; }

}  // namespace lk::model
