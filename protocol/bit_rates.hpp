#pragma once

/// @file Bit rates of drives, with the codes used in their settings and in the vendor's PC tool
/// (docs/reference/protocol.md §10.9, docs/reference/rs485.md).

#include <cstdint>

#include "protocol/field.hpp"

namespace lk::protocol {

inline constexpr Value kSerialRates[] = {
    {0, "9600"},   {1, "19200"},  {2, "38400"},   {3, "57600"},   {4, "115200"},  {5, "230400"},
    {6, "460800"}, {7, "921600"}, {8, "1000000"}, {9, "2000000"}, {10, "4000000"}};
inline constexpr Value kCanRates[] = {
    {0, "100000"}, {1, "125000"}, {2, "250000"}, {3, "500000"}, {4, "1000000"}};

/// Returns the rate of a row, bit/s.
constexpr std::int64_t bit_rate(const Value& row) {
  std::int64_t rate = 0;
  for (const char digit : row.word) rate = 10 * rate + (digit - '0');
  return rate;
}
static_assert(bit_rate(kSerialRates[4]) == 115'200);

}  // namespace lk::protocol
