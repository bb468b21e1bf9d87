#pragma once

/// @file Fields on the wire of one generation and series, in a form for DBC files and Wireshark.

#include <cstdint>
#include <string_view>
#include <vector>

#include "protocol/command_info.hpp"

namespace lk::formats {

using protocol::Value;

/// A field with a little-endian integer n and the value n·`lsb`. Within a generation, all queries
/// have the same bits for a name; so do all replies.
struct Field {
  std::string_view name;   // "iq"
  std::string_view label;  // "Torque current"
  unsigned first_bit = 0;  // of DATA[0..7]; bytes begin at multiples of 8
  unsigned bits = 0;
  bool is_signed = false;
  double lsb = 1;
  protocol::UnitTexts unit = {};
  std::int64_t raw_min = 0;
  std::int64_t raw_max = 0;  // range of n; in queries, the range to which drives clamp it, if any
  std::vector<Value> values = {};
  // Not empty: the field exists only if an earlier field, with this name, has the value `only_at`.
  std::string_view selector = {};
  unsigned only_at = 0;
  bool selects = false;  // true: other fields have this field as their `selector`
};

/// Returns the fields of `rows` that exist in `format`. Each flag becomes a field of one bit.
std::vector<Field> fields_of(std::span<const protocol::Field> rows,
                             const protocol::WireFormat& format);
/// Returns the fields of a multi-drive query. The slots of 0x288 list all commands as their values.
std::vector<Field> multi_drive_fields(const protocol::CommandInfo& command,
                                      const protocol::WireFormat& format);

/// Returns the command bytes that a drive has, with their names.
std::vector<Value> command_values(const protocol::WireFormat& format);

}  // namespace lk::formats
