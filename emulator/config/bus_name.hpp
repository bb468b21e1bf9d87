#pragma once

/// @file Names of buses: an interface, or a URI that says how hosts connect. One row per scheme;
/// help, errors and docs/guides/buses.md are made from the rows.

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <variant>

namespace lk::emulator {

enum class Transport : std::uint8_t {
  kSocketCan,
  kSlcanTcp,
  kSlcanPty,
  kSocketcand,
  kUdpMulticast,
  kRs485,
  kRs485Tcp,
};

/// Kind of place after the scheme's colon.
enum class BusPlace : std::uint8_t { kInterface, kPath, kPort, kGroup };

struct BusScheme {
  Transport transport;
  std::string_view prefix;  // "slcan-tcp:"; empty: a bare name
  BusPlace place;
  bool serial;               // RS-485, otherwise CAN
  std::string_view form;     // "slcan-tcp:[ADDR:]PORT"
  std::string_view example;  // can be copied
  std::string_view hosts;    // how a host connects, for the example
};
std::span<const BusScheme> bus_schemes();
/// Returns one example of each scheme: "vcan0, slcan-tcp:29536, …".
std::string bus_examples();

/// A parsed bus name.
struct BusName {
  const BusScheme* scheme;
  std::string path = {};     // or the interface
  std::string address = {};  // of port or group: an IP address without brackets
  std::uint16_t port = 0;
  int ttl = 0;       // of a group: number of networks a datagram may cross
  bool acks = true;  // slcan-tcp: commands are acknowledged
};
/// Returns the parsed name, or the reason why it is invalid.
std::variant<BusName, std::string> parse_bus_name(const std::string& name);
/// Pre: `name` is valid.
BusName bus_name(const std::string& name);

/// Returns the scheme of a name, even if the part after the colon is invalid.
const BusScheme& scheme_of(std::string_view name);
/// Returns true for an RS-485 bus.
bool is_serial_name(std::string_view name);

/// Makes a bus name usable as part of a file name.
std::string bus_file_name(std::string name);

}  // namespace lk::emulator
