#pragma once

#include <string>

namespace lk::formats {

/// The table of docs/protocol.md §10.1: what of the wire only some generations have, and which of
/// them, on CAN and on RS-485.
std::string generation_page();

}  // namespace lk::formats
