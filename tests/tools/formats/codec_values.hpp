#pragma once

/// @file Values of a frame by the codec, with the names of the field table.

#include <map>
#include <string>

#include "protocol/codec.hpp"

namespace lk::test {

using Values = std::map<std::string, double>;

/// Pre: the format knows the frame; otherwise throws std::runtime_error.
Values query_values(const protocol::Frame& frame, const protocol::WireFormat& format);
Values reply_values(const protocol::Frame& frame, const protocol::WireFormat& format);

}  // namespace lk::test
