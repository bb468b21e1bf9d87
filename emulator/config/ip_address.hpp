#pragma once

/// @file IP addresses as text, without name lookup.

#include <optional>
#include <string>
#include <string_view>

namespace lk::emulator {

inline constexpr const char* kLoopback = "127.0.0.1";

/// Parses "127.0.0.1", "[::1]" (as in a URI) or "localhost". Returns the address in normal form
/// without brackets, localhost as 127.0.0.1; nullopt if invalid.
std::optional<std::string> address_in(std::string_view text);

/// Returns true for 224.0.0.0/4 (RFC 5771) and ff00::/8 (RFC 4291). Pre: no brackets.
bool is_multicast(const std::string& address);
/// Returns true for 127.0.0.0/8 and ::1, which other machines cannot reach.
bool is_loopback(const std::string& address);

}  // namespace lk::emulator
