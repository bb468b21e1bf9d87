#pragma once

/// @file Converts between bytes and numbers, and rounds values to fields. Only this file knows the
/// byte order.

#include <cassert>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>

#include "protocol/frame.hpp"
#include "protocol/rounding.hpp"

namespace lk::protocol {

/// Largest value of a two-byte field.
inline constexpr std::uint32_t kUint16Max = 0xFFFF;

/// Returns the little-endian integer that starts at byte `at`.
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
  const auto bits = static_cast<std::uint64_t>(value);  // NOLINT: bits beyond T are cut off
  for (std::size_t k = 0; k < sizeof(T); ++k) {
    data[at + k] = static_cast<std::uint8_t>(bits >> (8 * k));
  }
}

// Range of the multi-turn angle on CAN, which has seven bytes for it: DATA[1..7].
inline constexpr std::int64_t kInt56Max = (std::int64_t{1} << 55) - 1;
inline constexpr std::int64_t kInt56Min = -(std::int64_t{1} << 55);

/// Returns the signed 56-bit number in DATA[1..7].
constexpr std::int64_t get_le56(const Payload& data) {
  // The shift drops DATA[0] and extends the sign bit of DATA[7]. Shifts of negative numbers are
  // arithmetic since C++20.
  return get_le<std::int64_t>(data, 0) >> 8;
}

/// Writes `value` to DATA[1..7], saturated to 56 bits; does not change DATA[0].
constexpr void put_le56(Payload& data, std::int64_t value) {
  const std::int64_t held = value < kInt56Min ? kInt56Min : value > kInt56Max ? kInt56Max : value;
  for (std::size_t k = 0; k < 7; ++k) {
    data[1 + k] = static_cast<std::uint8_t>(static_cast<std::uint64_t>(held) >> (8 * k));
  }
}

/// Returns the field value of a quantity: `value / lsb`, rounded to the nearest integer (halves
/// away from zero) and saturated to [lo, hi]. Truncation would put a fifth of all speeds one LSB
/// off. An infinity saturates, a NaN gives `lo`.
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
