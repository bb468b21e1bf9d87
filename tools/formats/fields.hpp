#pragma once

/// @file The fields of the wire as one generation of one series has them, for those who read the
/// bus with programs of other people.

#include <cstdint>
#include <string_view>
#include <vector>

#include "protocol/command_info.hpp"

namespace lk::formats {

using protocol::Value;

/// A little-endian integer, which stands for `lsb` times itself. The same name is the same bits in
/// all queries of a generation, and in all replies.
struct Field {
  std::string_view name;   // "iq"
  std::string_view label;  // "Torque current"
  unsigned first_bit = 0;  // of DATA[0..7]; bytes begin at multiples of 8
  unsigned bits = 0;
  bool is_signed = false;
  double lsb = 1;
  protocol::UnitTexts unit = {};
  std::int64_t raw_min = 0;
  std::int64_t raw_max = 0;  // where drives clamp a query they clamp it to these
  std::vector<Value> values = {};
  // Not empty: only where the field of this name, before it, is `only_at`.
  std::string_view selector = {};
  unsigned only_at = 0;
  bool selects = false;  // it is the selector of others
};

/// Those of `rows` that `format` has; a byte of flags is a field for each.
std::vector<Field> fields_of(std::span<const protocol::Field> rows,
                             const protocol::WireFormat& format);
/// DATA[0..7] of a query to several drives; a slot for any command has the words of all.
std::vector<Field> multi_drive_fields(const protocol::CommandInfo& command,
                                      const protocol::WireFormat& format);

/// The command bytes that a drive knows, by name.
std::vector<Value> command_values(const protocol::WireFormat& format);

}  // namespace lk::formats
