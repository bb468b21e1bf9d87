#pragma once

/// @file The part of std::experimental::simd that the tick uses, built on a plain array. For
/// standard libraries without std::experimental::simd (libc++). Each element gets the same IEEE
/// operations, so results have the same bits. Names and meanings follow the Parallelism TS 2.

#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <functional>

// NOLINTBEGIN(readability-identifier-naming): names of the standard
namespace lk::model::array_simd {

template <std::size_t n>
struct Elements {
  static constexpr std::size_t kSize = n;
};

/// Returns the vector or mask whose element n is `act(of[n]...)`.
template <class Result, class Act, class... Of>
Result each(const Act& act, const Of&... of) {
  return Result([&](std::size_t n) { return act(of[n]...); });
}

struct vector_aligned_tag {};
inline constexpr vector_aligned_tag vector_aligned;

template <class T, class Abi>
class simd_mask {
 public:
  static constexpr std::size_t size() { return Abi::kSize; }

  simd_mask() = default;
  /// Element n is `of(n)`.
  template <std::invocable<std::size_t> Generator>
  explicit simd_mask(const Generator& of) {
    for (std::size_t n = 0; n < size(); ++n) set_[n] = of(n);
  }
  bool operator[](std::size_t n) const { return set_[n]; }
  friend simd_mask operator&&(const simd_mask& a, const simd_mask& b) {
    return each<simd_mask>(std::logical_and(), a, b);
  }
  friend simd_mask operator||(const simd_mask& a, const simd_mask& b) {
    return each<simd_mask>(std::logical_or(), a, b);
  }

 private:
  std::array<bool, Abi::kSize> set_{};
};

template <class T, class Abi>
bool any_of(const simd_mask<T, Abi>& mask) {
  bool any = false;
  for (std::size_t n = 0; n < mask.size(); ++n) any = any || mask[n];
  return any;
}

template <class T, class Abi>
class simd {
 public:
  using mask_type = simd_mask<T, Abi>;
  static constexpr std::size_t size() { return Abi::kSize; }

  simd() = default;
  simd(T x) { element_.fill(x); }  // NOLINT(google-explicit-constructor): for 2.0 * x
  /// Element n is `of(n)`.
  template <std::invocable<std::size_t> Generator>
  explicit simd(const Generator& of) {
    for (std::size_t n = 0; n < size(); ++n) element_[n] = of(n);
  }
  T operator[](std::size_t n) const { return element_[n]; }
  void copy_from(const T* from, vector_aligned_tag) {
    for (std::size_t n = 0; n < size(); ++n) element_[n] = from[n];
  }
  void copy_to(T* to, vector_aligned_tag) const {
    for (std::size_t n = 0; n < size(); ++n) to[n] = element_[n];
  }

  simd& operator+=(const simd& b) { return *this = *this + b; }
  simd& operator^=(const simd& b) { return *this = *this ^ b; }
  friend simd operator-(const simd& a) { return each<simd>(std::negate(), a); }
  friend simd operator+(const simd& a, const simd& b) { return each<simd>(std::plus(), a, b); }
  friend simd operator-(const simd& a, const simd& b) { return each<simd>(std::minus(), a, b); }
  friend simd operator*(const simd& a, const simd& b) {
    return each<simd>(std::multiplies(), a, b);
  }
  friend simd operator/(const simd& a, const simd& b) { return each<simd>(std::divides(), a, b); }
  friend simd operator&(const simd& a, const simd& b) { return each<simd>(std::bit_and(), a, b); }
  friend simd operator|(const simd& a, const simd& b) { return each<simd>(std::bit_or(), a, b); }
  friend simd operator^(const simd& a, const simd& b) { return each<simd>(std::bit_xor(), a, b); }
  friend simd operator<<(const simd& a, int bits) {
    return simd([&](std::size_t n) { return a[n] << bits; });
  }
  friend simd operator>>(const simd& a, int bits) {
    return simd([&](std::size_t n) { return a[n] >> bits; });
  }
  friend mask_type operator<(const simd& a, const simd& b) {
    return each<mask_type>(std::less(), a, b);
  }
  friend mask_type operator>(const simd& a, const simd& b) {
    return each<mask_type>(std::greater(), a, b);
  }
  friend mask_type operator==(const simd& a, const simd& b) {
    return each<mask_type>(std::equal_to(), a, b);
  }
  friend mask_type operator!=(const simd& a, const simd& b) {
    return each<mask_type>(std::not_equal_to(), a, b);
  }

 private:
  // The default constructor leaves the elements uninitialised, as in the standard.
  std::array<T, Abi::kSize> element_;
};

template <class T>
using native_simd = simd<T, Elements<2>>;

template <class T, class Simd>
struct Rebound;
template <class T, class U, class Abi>
struct Rebound<T, simd<U, Abi>> {
  using type = simd<T, Abi>;
};
template <class T, class Simd>
using rebind_simd_t = typename Rebound<T, Simd>::type;

namespace simd_abi {
template <class T, std::size_t n>
using deduce_t = Elements<n>;
}  // namespace simd_abi

/// Result of `where(mask, x)`: assigns to the elements of x whose mask is set.
template <class T, class Abi>
class Chosen {
 public:
  Chosen(const simd_mask<T, Abi>& mask, simd<T, Abi>& x) : mask_(mask), x_(x) {}
  // NOLINTNEXTLINE(*-assign-operator,*-copy-assignment-signature): a temporary
  void operator=(const simd<T, Abi>& a) && {
    x_ = simd<T, Abi>([&](std::size_t n) { return mask_[n] ? a[n] : x_[n]; });
  }

 private:
  const simd_mask<T, Abi>& mask_;
  simd<T, Abi>& x_;
};
template <class T, class Abi>
Chosen<T, Abi> where(const simd_mask<T, Abi>& mask, simd<T, Abi>& x) {
  return {mask, x};
}

template <class T, class Abi>
simd<T, Abi> sqrt(const simd<T, Abi>& x) {
  return simd<T, Abi>([&](std::size_t n) { return std::sqrt(x[n]); });
}
template <class T, class Abi>
simd<T, Abi> abs(const simd<T, Abi>& x) {
  return simd<T, Abi>([&](std::size_t n) { return std::abs(x[n]); });
}
template <class T, class Abi>
simd<T, Abi> min(const simd<T, Abi>& a, const simd<T, Abi>& b) {
  return simd<T, Abi>([&](std::size_t n) { return a[n] < b[n] ? a[n] : b[n]; });
}
template <class T, class Abi>
simd<T, Abi> max(const simd<T, Abi>& a, const simd<T, Abi>& b) {
  return simd<T, Abi>([&](std::size_t n) { return a[n] > b[n] ? a[n] : b[n]; });
}

}  // namespace lk::model::array_simd
// NOLINTEND(readability-identifier-naming)
