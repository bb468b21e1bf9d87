#pragma once

/// @file The number type of the fast tick: one drive (`double`) or eight drives side by side (`Lanes`).
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

template <class Result, class Operand, class Op>
inline Result zip(const Operand& a, const Operand& b, Op op) {
  Result result;
  for (std::size_t n = 0; n < a.part.size(); ++n) {
    result.part[n] = op(a.part[n], b.part[n]);
  }
  return result;
}

/// Eight doubles in as many vector registers as this instruction set needs. (libstdc++'s own
/// fixed_size_simd keeps its masks as bit sets, which costs more than the arithmetic.)
struct Lanes {
  using Vector = std::experimental::native_simd<double>;
  static constexpr std::size_t kParts = kLanes / Vector::size();
  static_assert(kParts * Vector::size() == kLanes);

  struct Mask {
    friend Mask operator&&(const Mask& a, const Mask& b) {
      return zip<Mask>(a, b, [](const auto& x, const auto& y) { return x && y; });
    }
    friend Mask operator||(const Mask& a, const Mask& b) {
      return zip<Mask>(a, b, [](const auto& x, const auto& y) { return x || y; });
    }
    bool operator[](std::size_t lane) const {
      return part[lane / Vector::size()][lane % Vector::size()];
    }

    std::array<Vector::mask_type, kParts> part;
  };

  Lanes() = default;
  Lanes(double x) { part.fill(Vector(x)); }  // NOLINT(google-explicit-constructor): numbers mix

  double operator[](std::size_t lane) const { return part[lane / Vector::size()][lane % Vector::size()]; }
  void set(std::size_t lane, double x) { part[lane / Vector::size()][lane % Vector::size()] = x; }
  void copy_from(const double* x) {
    for (std::size_t n = 0; n < kParts; ++n) {
      part[n].copy_from(x + n * Vector::size(), std::experimental::vector_aligned);
    }
  }
  void copy_to(double* x) const {
    for (std::size_t n = 0; n < kParts; ++n) {
      part[n].copy_to(x + n * Vector::size(), std::experimental::vector_aligned);
    }
  }

  friend Lanes operator+(const Lanes& a, const Lanes& b) {
    return zip<Lanes>(a, b, [](const auto& x, const auto& y) { return x + y; });
  }
  friend Lanes operator-(const Lanes& a, const Lanes& b) {
    return zip<Lanes>(a, b, [](const auto& x, const auto& y) { return x - y; });
  }
  friend Lanes operator*(const Lanes& a, const Lanes& b) {
    return zip<Lanes>(a, b, [](const auto& x, const auto& y) { return x * y; });
  }
  friend Lanes operator/(const Lanes& a, const Lanes& b) {
    return zip<Lanes>(a, b, [](const auto& x, const auto& y) { return x / y; });
  }
  friend Lanes operator-(const Lanes& a) {
    return zip<Lanes>(a, a, [](const auto& x, const auto& /*same*/) { return -x; });
  }
  Lanes& operator+=(const Lanes& b) { return *this = *this + b; }

  friend Mask operator<(const Lanes& a, const Lanes& b) {
    return zip<Mask>(a, b, [](const auto& x, const auto& y) { return x < y; });
  }
  friend Mask operator>(const Lanes& a, const Lanes& b) { return b < a; }
  friend Mask operator==(const Lanes& a, const Lanes& b) {
    return zip<Mask>(a, b, [](const auto& x, const auto& y) { return x == y; });
  }
  friend Mask operator!=(const Lanes& a, const Lanes& b) {
    return zip<Mask>(a, b, [](const auto& x, const auto& y) { return x != y; });
  }

  friend Lanes select(const Mask& mask, const Lanes& a, const Lanes& b) {
    Lanes result = b;
    for (std::size_t n = 0; n < kParts; ++n) {
      std::experimental::where(mask.part[n], result.part[n]) = a.part[n];
    }
    return result;
  }
  friend bool any(const Mask& mask) {
    bool result = false;
    for (const auto& part : mask.part) {
      result = result || std::experimental::any_of(part);
    }
    return result;
  }
  friend Lanes sqrt(const Lanes& a) {
    return zip<Lanes>(a, a, [](const auto& x, const auto& /*same*/) { return std::experimental::sqrt(x); });
  }

  std::array<Vector, kParts> part;
};

inline double select(bool mask, double a, double b) { return mask ? a : b; }
inline bool any(bool mask) { return mask; }
inline double sqrt(double x) { return std::sqrt(x); }

template <class Real>
inline Real min(const Real& a, const Real& b) {
  return select(b < a, b, a);
}
template <class Real>
inline Real max(const Real& a, const Real& b) {
  return select(a < b, b, a);
}
template <class Real>
inline Real clamp(const Real& x, const Real& low, const Real& high) {
  return min(max(x, low), high);
}
template <class Real>
inline Real abs(const Real& x) {
  return select(x < 0.0, -x, x);
}
/// Nearest integer, ties to even, for |x| < 2^51: the sum loses exactly the fraction bits.
template <class Real>
inline Real round(const Real& x) {
  return (x + 0x1.8p52) - 0x1.8p52;
}
template <class Real>
inline Real floor(const Real& x) {
  const Real nearest = round(x);
  return select(x < nearest, nearest - 1.0, nearest);
}

inline double load(double stored) { return stored; }
inline Lanes load(const Wide& stored) {
  Lanes value;
  value.copy_from(stored.lane.data());
  return value;
}
inline void store(double value, double& to) { to = value; }
inline void store(const Lanes& value, Wide& to) {
  value.copy_to(to.lane.data());
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
