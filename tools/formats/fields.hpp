#pragma once

/// @file Fields on the wire of one generation and series, for programs that are not ours.

#include <cstdint>
#include <string_view>
#include <vector>

#include "protocol/command_info.hpp"

namespace lk::formats {

using protocol::Value;

/// A little-endian integer n, with the value n·`lsb`. Within a generation, a name means the same
/// bits in all queries, and in all replies.
struct Field {
  std::string_view name;   // "iq"
  std::string_view label;  // "Torque current"
  unsigned first_bit = 0;  // of DATA[0..7]; bytes begin at multiples of 8
  unsigned bits = 0;
  bool is_signed = false;
  double lsb = 1;
  protocol::UnitTexts unit = {};
  std::int64_t raw_min = 0;
  std::int64_t raw_max = 0;  // range to which drives clamp a query, if they do
  std::vector<Value> values = {};
  // Not empty: the field exists only if the earlier field of this name is `only_at`.
  std::string_view selector = {};
  unsigned only_at = 0;
  bool selects = false;  // selects other fields
};

/// Returns the fields of `rows` that `format` has; each flag becomes a field.
std::vector<Field> fields_of(std::span<const protocol::Field> rows,
                             const protocol::WireFormat& format);
/// Returns the fields of a multi-drive query; a slot for any command lists all commands.
std::vector<Field> multi_drive_fields(const protocol::CommandInfo& command,
                                      const protocol::WireFormat& format);

/// Returns the command bytes that a drive has, with their names.
std::vector<Value> command_values(const protocol::WireFormat& format);

}  // namespace lk::formats
