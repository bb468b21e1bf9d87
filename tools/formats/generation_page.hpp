#pragma once

#include <string>

namespace lk::formats {

/// Returns the table of docs/reference/protocol.md §10.1: differences of generations, on CAN and on
/// RS-485.
std::string generation_page();

}  // namespace lk::formats
