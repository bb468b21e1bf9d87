#pragma once

/// @file What the codec says of a frame, by the names of the field table.

#include <map>
#include <string>

#include "protocol/codec.hpp"

namespace lk::test {

using Values = std::map<std::string, double>;

/// A frame that the format knows; throws std::runtime_error otherwise.
Values query_values(const protocol::Frame& frame, const protocol::WireFormat& format);
Values reply_values(const protocol::Frame& frame, const protocol::WireFormat& format);

}  // namespace lk::test
