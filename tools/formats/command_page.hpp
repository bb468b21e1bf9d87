#pragma once

#include <string>

namespace lk::formats {

/// Returns the generated part of docs/reference/protocol.md: all commands, and all fields, in
/// Markdown.
std::string command_page();
/// Returns the table of docs/reference/rs485.md: commands of RS-485, and the generations that have
/// them.
std::string serial_command_page();

}  // namespace lk::formats
