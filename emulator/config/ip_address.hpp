#pragma once

/// @file IP addresses as text. No name is looked up.

#include <optional>
#include <string>
#include <string_view>

namespace lk::emulator {

inline constexpr const char* kLoopback = "127.0.0.1";

/// "127.0.0.1", "[::1]", "localhost": as in a URI, where an address of IPv6 stands in brackets.
/// Without them and in the usual spelling; localhost is 127.0.0.1. Nothing: it is no address.
std::optional<std::string> address_in(std::string_view text);

/// Of an address without brackets: 224.0.0.0/4 (RFC 5771), ff00::/8 (RFC 4291).
bool is_multicast(const std::string& address);
/// 127.0.0.0/8, ::1: nobody else reaches it.
bool is_loopback(const std::string& address);

}  // namespace lk::emulator
