#pragma once

#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>

namespace lk::emulator {

/// A number that a log tells, with the interval that holds the true one in 95 of 100 logs.
struct Estimate {
  double value = 0;
  double half_width = 0;  // of the interval

  double low() const { return value - half_width; }
  double high() const { return value + half_width; }
};

/// How well it is known: A within 5 %, B within 15 %, C within 50 %, which is too rough for a motor
/// file; U: the log does not tell it (assumed).
enum class Quality : std::uint8_t { kA, kB, kC, kUnknown };

constexpr Quality quality_of(const Estimate& estimate) {
  // None of what is looked for can be negative.
  const double value = estimate.value;
  if (!(value > 0) || !(estimate.half_width <= 0.5 * value)) return Quality::kUnknown;
  if (estimate.half_width <= 0.05 * value) return Quality::kA;
  return estimate.half_width <= 0.15 * value ? Quality::kB : Quality::kC;
}
constexpr bool is_told(const Estimate& estimate) { return quality_of(estimate) <= Quality::kB; }
constexpr char letter(Quality quality) { return "ABCU"[static_cast<int>(quality)]; }

}  // namespace lk::emulator
