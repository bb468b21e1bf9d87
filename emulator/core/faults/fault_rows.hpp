#pragma once

/// @file Parts of the fault table, and functions for writing its rows.

#include "emulator/core/faults/fault_table.hpp"

namespace lk::emulator {

std::span<const FaultRow> link_faults();
std::span<const FaultRow> adapter_faults();
std::span<const FaultRow> serial_faults();
std::span<const FaultRow> plant_faults();
std::span<const FaultRow> firmware_faults();

constexpr FaultParam number(std::string_view word, double min, double max, double fallback) {
  return {.word = word, .min = min, .max = max, .fallback = fallback};
}
constexpr FaultParam count(std::string_view word, double min, double max, double fallback) {
  return {.word = word, .min = min, .max = max, .fallback = fallback, .whole = true};
}
constexpr FaultParam needed(std::string_view word, double min, double max) {
  return {.word = word, .min = min, .max = max, .required = true};
}
constexpr FaultParam needed_count(std::string_view word, double min, double max) {
  return {.word = word, .min = min, .max = max, .required = true, .whole = true};
}
/// `words` name the values of the enumeration `Choice`, in its order.
template <class Choice>
constexpr FaultParam choice(std::string_view word, std::span<const std::string_view> words,
                            Choice fallback) {
  return {.word = word, .fallback = fallback, .choices = words};
}

inline SimTime from_ms(double time_ms) {
  return std::chrono::duration_cast<SimTime>(std::chrono::duration<double, std::milli>(time_ms));
}

}  // namespace lk::emulator
