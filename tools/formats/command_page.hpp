#pragma once

#include <string>

namespace lk::formats {

/// The part of docs/protocol.md that is generated: all commands, and all fields, in Markdown.
std::string command_page();
/// The commands of RS-485, and who knows them there and on CAN: the table of docs/rs485.md.
std::string serial_command_page();

}  // namespace lk::formats
