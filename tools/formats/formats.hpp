#pragma once

/// @file Texts for other programs and for the documents.

#include <cstdint>
#include <string>
#include <string_view>

#include "protocol/wire_format.hpp"

namespace lk::formats {

/// A DBC file has either queries or replies, because both share identifier and DATA[0].
enum class Direction : std::uint8_t { kQueries, kReplies };

/// Returns the DBC file for all drives of a bus with this format and generation. Multi-drive
/// queries have their own identifiers, so they are in both files.
std::string dbc(Direction direction, std::string_view generation,
                const protocol::WireFormat& format);

/// Returns the Wireshark dissector: `program`, with the tables in place of its line "-- @tables".
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
