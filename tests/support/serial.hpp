#pragma once

/// @file Bytes of RS-485 in hexadecimal digits, for tests.

#include <cstdint>
#include <cstdio>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/serial_framing.hpp"

namespace lk::test {

using Bytes = std::vector<std::uint8_t>;

/// Parses "3E 9A 01 00 D9"; "(14 x 00)" means fourteen bytes.
inline Bytes bytes(std::string_view text) {
  Bytes result;
  for (std::size_t at = 0; at < text.size();) {
    if (text[at] == ' ') {
      ++at;
    } else if (text[at] == '(') {
      const std::size_t end = text.find(')', at);
      const std::size_t cross = text.find(" x ", at);
      const auto count = std::stoul(std::string(text.substr(at + 1, cross - at - 1)));
      const auto value = std::stoul(std::string(text.substr(cross + 3, 2)), nullptr, 16);
      result.insert(result.end(), count, static_cast<std::uint8_t>(value));
      at = end + 1;
    } else {
      result.push_back(
          static_cast<std::uint8_t>(std::stoul(std::string(text.substr(at, 2)), nullptr, 16)));
      at += 2;
    }
  }
  return result;
}

inline std::string hex(std::span<const std::uint8_t> bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) {
    char digits[4];
    std::snprintf(digits, sizeof digits, "%02X", byte);
    text += (text.empty() ? "" : " ") + std::string(digits);
  }
  return text;
}
inline std::string hex(const protocol::Frame& frame) {
  return hex(protocol::wire_bytes(frame).view());
}
/// Normalises hexadecimal digits.
inline std::string hex(std::string_view text) { return hex(bytes(text)); }

/// Returns the bytes as a packet. Pre: they are one.
inline protocol::Frame packet(std::string_view text) {
  const Bytes all = bytes(text);
  const auto found = protocol::packet_at(all);
  if (!found || protocol::wire_bytes(*found).size != all.size()) {
    throw std::invalid_argument("no packet: " + std::string(text));
  }
  return *found;
}

}  // namespace lk::test
