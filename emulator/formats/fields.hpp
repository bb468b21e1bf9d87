#pragma once

/// @file The fields of all commands and replies as data, for those who read the bus with programs
/// of other people. The codec of protocol/ is what counts; a test holds this table to it, bit for
/// bit.

#include <cstdint>
#include <string_view>
#include <vector>

#include "protocol/codec.hpp"

namespace lk::formats {

/// What a number stands for.
struct Value {
  unsigned number = 0;
  std::string_view word;
};

/// A little-endian integer, which stands for `lsb` times itself. The same name is the same bits in
/// all queries of a generation, and in all replies.
struct Field {
  std::string_view name;   // "iq"
  std::string_view label;  // "Torque current"
  unsigned first_bit = 0;  // of DATA[0..7]; bytes begin at multiples of 8
  unsigned bits = 0;
  bool is_signed = false;
  double lsb = 1;
  std::string_view unit = {};  // ASCII, as DBC files want it
  std::int64_t raw_min = 0;
  std::int64_t raw_max = 0;  // where drives clamp a query they clamp it to these
  std::vector<Value> values = {};
  int parameter = -1;  // >= 0: only where the field `parameter` is this (0xC0, 0xC1)
};

/// DATA[1..7] of a query to one drive.
std::vector<Field> query_fields(protocol::Opcode opcode, const protocol::WireFormat& format);
/// DATA[1..7] of the reply to it.
std::vector<Field> reply_fields(protocol::Opcode opcode, const protocol::WireFormat& format);
/// DATA[0..7] of a query to several drives.
std::vector<Field> multi_drive_fields(std::uint32_t id, const protocol::WireFormat& format);

/// Is the reply a copy of the query?
bool is_echo(protocol::Opcode opcode);

/// The command bytes that a drive knows, by name.
std::vector<Value> commands(const protocol::WireFormat& format);

}  // namespace lk::formats
