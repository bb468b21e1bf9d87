#pragma once

/// @file Generates files for other programs, and tables for the documents.

#include <cstdint>
#include <string>
#include <string_view>

#include "protocol/wire_format.hpp"

namespace lk::formats {

/// Contents of a DBC file: queries or replies. A file cannot have both, because a query and its
/// reply share identifier and DATA[0].
enum class Direction : std::uint8_t { kQueries, kReplies };

/// Returns the DBC file for a bus with drives of this format and generation at all IDs. Multi-drive
/// queries have their own identifiers, so they are in both files.
std::string dbc(Direction direction, std::string_view generation,
                const protocol::WireFormat& format);

/// Returns the Wireshark dissector: `program` with its line "-- @tables" replaced by the tables.
std::string dissector(const std::string& program);

/// Returns the generated part of docs/reference/protocol.md: all commands, and all fields, in
/// Markdown.
std::string command_page();
/// Returns the table of docs/reference/rs485.md: commands of RS-485, and the generations that have
/// them.
std::string serial_command_page();
/// Returns the table of docs/reference/protocol.md §10.1: differences of generations, on CAN and on
/// RS-485.
std::string generation_page();

}  // namespace lk::formats
