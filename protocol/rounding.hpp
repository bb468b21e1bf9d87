#pragma once

/// @file Rounding without libm, which rounds halves and their neighbours wrong on some systems.
/// Every machine must put the same bits on the wire.

#include <cstdint>

namespace lk::protocol {

/// Returns the nearest whole number, halves away from zero; |x| < 2^63.
constexpr std::int64_t rounded(double x) {
  const auto whole = static_cast<std::int64_t>(x);
  const double rest = x - static_cast<double>(whole);  // exact
  return whole + (rest >= 0.5 ? 1 : 0) - (rest <= -0.5 ? 1 : 0);
}

/// Returns the largest whole number not above x; |x| < 2^63.
constexpr std::int64_t rounded_down(double x) {
  const auto whole = static_cast<std::int64_t>(x);
  return whole - (x < static_cast<double>(whole) ? 1 : 0);
}

}  // namespace lk::protocol
