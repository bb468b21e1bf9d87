#pragma once

/// @file What a bus may be called: the name of an interface, or a URI that says how hosts get to
/// it. One row a scheme; help, errors and docs/buses.md are made of them.

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

/// What stands behind the colon.
enum class BusPlace : std::uint8_t { kInterface, kPath, kPort, kGroup };

struct BusScheme {
  Transport transport;
  std::string_view prefix;  // "slcan-tcp:"; empty: a bare name
  BusPlace place;
  bool serial;               // RS-485, else CAN
  std::string_view form;     // "slcan-tcp:[ADDR:]PORT"
  std::string_view example;  // that can be copied
  std::string_view hosts;    // who gets on it, and how, for the example
};
std::span<const BusScheme> bus_schemes();
/// "vcan0, slcan-tcp:29536, …": an example of each.
std::string bus_examples();

/// A name taken apart.
struct BusName {
  const BusScheme* scheme;
  std::string path = {};     // or the interface
  std::string address = {};  // of a port or group: an IP address without brackets
  std::uint16_t port = 0;
  int ttl = 0;       // of a group: how many networks away others may be
  bool acks = true;  // of slcan-tcp: commands are acknowledged
};
/// Or why it is no name of a bus.
std::variant<BusName, std::string> parse_bus_name(const std::string& name);
/// Of a name that is one.
BusName bus_name(const std::string& name);

/// The scheme of a name, whether or not what follows the colon is valid.
const BusScheme& scheme_of(std::string_view name);
/// Is the bus of this name one of RS-485?
bool is_serial_name(std::string_view name);

/// A name of a bus as a part of a file's name.
std::string bus_file_name(std::string name);

}  // namespace lk::emulator
