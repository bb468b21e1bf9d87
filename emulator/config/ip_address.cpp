#include "emulator/config/ip_address.hpp"

#ifdef _WIN32
#include <ws2tcpip.h>
#else
#include <arpa/inet.h>
#include <netinet/in.h>
#endif

#include <array>
#include <cstdint>

#include "emulator/core/text.hpp"

namespace lk::emulator {
namespace {

/// Address in network byte order. An IPv4 address uses the first four bytes.
using AddressBytes = std::array<std::uint8_t, 16>;

bool has_colon(const std::string& address) { return address.find(':') != std::string::npos; }

/// Returns the bytes of `address`, without its zone ("%eth0", RFC 4007); nullopt if invalid.
std::optional<AddressBytes> bytes_of(const std::string& address) {
  AddressBytes bytes{};
  const int family = has_colon(address) ? AF_INET6 : AF_INET;
  const std::string without = family == AF_INET6 ? address.substr(0, address.find('%')) : address;
  return ::inet_pton(family, without.c_str(), bytes.data()) == 1 ? std::optional(bytes)
                                                                 : std::nullopt;
}

}  // namespace

std::optional<std::string> address_in(std::string_view text) {
  if (small_letters(std::string(text)) == "localhost") return kLoopback;
  const bool bracketed = text.size() > 2 && text.front() == '[' && text.back() == ']';
  const std::string address(bracketed ? text.substr(1, text.size() - 2) : text);
  const auto bytes = bytes_of(address);
  if (!bytes || bracketed != has_colon(address)) return std::nullopt;
  std::array<char, INET6_ADDRSTRLEN> usual{};
  ::inet_ntop(bracketed ? AF_INET6 : AF_INET, bytes->data(), usual.data(), usual.size());
  const std::size_t zone = address.find('%');
  return usual.data() + (zone == std::string::npos ? "" : address.substr(zone));
}

bool is_multicast(const std::string& address) {
  const auto bytes = bytes_of(address);
  return bytes && (has_colon(address) ? bytes->front() == 0xFF : bytes->front() >> 4U == 0xEU);
}

bool is_loopback(const std::string& address) {
  const auto bytes = bytes_of(address);
  return bytes && (has_colon(address) ? address == "::1" : bytes->front() == 127);
}

}  // namespace lk::emulator
