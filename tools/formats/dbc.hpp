#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "protocol/wire_format.hpp"

namespace lk::formats {

/// Query and reply share identifier and DATA[0], and a DBC file has one meaning for each: so a file
/// is for one of the two.
enum class Direction : std::uint8_t { kQueries, kReplies };

/// The DBC file for all drives of a bus that speak like `format`, of the generation `generation`.
/// The queries to several drives, which have identifiers of their own, are in both.
std::string dbc(Direction direction, std::string_view generation,
                const protocol::WireFormat& format);

}  // namespace lk::formats
