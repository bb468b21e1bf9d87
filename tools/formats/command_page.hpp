#pragma once

#include <string>

namespace lk::formats {

/// The part of docs/protocol.md that is generated: all commands, and all fields, in Markdown.
std::string command_page();

}  // namespace lk::formats
