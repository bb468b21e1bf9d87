#pragma once

/// @file Bus names: the name of a CAN interface, or a URI that states how hosts connect. Help,
/// error messages and the table in docs/guides/buses.md have one row per scheme.

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

/// Kind of text that follows the prefix of the scheme in a bus name.
enum class BusPlace : std::uint8_t { kInterface, kPath, kPort, kGroup };

struct BusScheme {
  Transport transport;
  std::string_view prefix;  // "slcan-tcp:"; empty: the name of a CAN interface
  BusPlace place;
  bool serial;               // true: RS-485, false: CAN
  std::string_view form;     // syntax: "slcan-tcp:[ADDR:]PORT"
  std::string_view example;  // a valid name that users can copy
  std::string_view hosts;    // how a host connects to the bus `example`
};
std::span<const BusScheme> bus_schemes();
/// Returns one example of each scheme: "vcan0, slcan-tcp:29536, …".
std::string bus_examples();

/// A parsed bus name.
struct BusName {
  const BusScheme* scheme;
  std::string path = {};     // path of a pty, or name of a CAN interface
  std::string address = {};  // IP address of the port or multicast group, without brackets
  std::uint16_t port = 0;
  int ttl = 0;       // multicast time to live: 0 = this machine only, 1 = the local network
  bool acks = true;  // slcan-tcp: the bus acknowledges each command of the client
};
/// Returns the parsed name, or the reason why it is invalid.
std::variant<BusName, std::string> parse_bus_name(const std::string& name);
/// Pre: `name` is valid.
BusName bus_name(const std::string& name);

/// Returns the scheme whose prefix `name` has; SocketCAN if none. Does not check the rest of
/// `name`.
const BusScheme& scheme_of(std::string_view name);
/// Returns true for an RS-485 bus.
bool is_serial_name(std::string_view name);

/// Makes a bus name usable as part of a file name.
std::string bus_file_name(std::string name);

}  // namespace lk::emulator
