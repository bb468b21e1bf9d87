#pragma once

/// @file Bytes and numbers: the only place that knows the byte order and how a value becomes a
/// field.

#include <cassert>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>

#include "protocol/frame.hpp"
#include "protocol/rounding.hpp"

namespace lk::protocol {

/// The largest value of a field of two bytes.
inline constexpr std::uint32_t kUint16Max = 0xFFFF;

/// The little-endian integer that starts at byte `at`.
template <std::integral T>
constexpr T get_le(const Payload& data, std::size_t at) {
  assert(at + sizeof(T) <= data.size());
  std::uint64_t bits = 0;
  for (std::size_t k = 0; k < sizeof(T); ++k) {
    bits |= std::uint64_t{data[at + k]} << (8 * k);
  }
  return static_cast<T>(bits);
}

/// Writes `value` as a little-endian integer that starts at byte `at`.
template <std::integral T>
constexpr void put_le(Payload& data, std::size_t at, T value) {
  assert(at + sizeof(T) <= data.size());
  const auto bits = static_cast<std::uint64_t>(value);  // NOLINT: what is beyond T is cut off
  for (std::size_t k = 0; k < sizeof(T); ++k) {
    data[at + k] = static_cast<std::uint8_t>(bits >> (8 * k));
  }
}

// The multi-turn angle: a 64-bit number of which the wire carries the low seven bytes, DATA[1..7].
inline constexpr std::int64_t kInt56Max = (std::int64_t{1} << 55) - 1;
inline constexpr std::int64_t kInt56Min = -(std::int64_t{1} << 55);

/// The signed 56-bit number in DATA[1..7].
constexpr std::int64_t get_le56(const Payload& data) {
  // DATA[0] falls out at the bottom while the sign bit of DATA[7] comes down (shifts of negative
  // numbers are arithmetic since C++20).
  return get_le<std::int64_t>(data, 0) >> 8;
}

/// Writes `value` to DATA[1..7], saturated to 56 bits; DATA[0] stays.
constexpr void put_le56(Payload& data, std::int64_t value) {
  const std::int64_t held = value < kInt56Min ? kInt56Min : value > kInt56Max ? kInt56Max : value;
  for (std::size_t k = 0; k < 7; ++k) {
    data[1 + k] = static_cast<std::uint8_t>(static_cast<std::uint64_t>(held) >> (8 * k));
  }
}

/// The field value of a physical quantity: `value / lsb`, rounded to the nearest integer (halves
/// away from zero) and saturated to [lo, hi]. Truncating instead would put a fifth of all speeds
/// one LSB off. Total: an infinity saturates, a NaN becomes `lo`.
template <std::integral T>
T quantize(double value, double lsb, T lo = std::numeric_limits<T>::min(),
           T hi = std::numeric_limits<T>::max()) {
  const double steps = value / lsb;
  if (steps >= static_cast<double>(hi)) {
    return hi;
  }
  if (!(steps > static_cast<double>(lo))) {
    return lo;
  }
  return static_cast<T>(rounded(steps));
}

}  // namespace lk::protocol
