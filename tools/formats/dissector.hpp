#pragma once

#include <string>

namespace lk::formats {

/// The dissector for Wireshark: `program`, with the tables of commands and fields in the place of
/// its line "-- @tables".
std::string dissector(const std::string& program);

}  // namespace lk::formats
