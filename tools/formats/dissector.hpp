#pragma once

#include <string>

namespace lk::formats {

/// Returns the Wireshark dissector: `program`, with the tables in place of its line "-- @tables".
std::string dissector(const std::string& program);

}  // namespace lk::formats
