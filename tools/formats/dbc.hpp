#pragma once

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

}  // namespace lk::formats
