#include "emulator/config/bus_name.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <optional>

#include "emulator/config/ip_address.hpp"
#include "emulator/core/text.hpp"

namespace lk::emulator {
namespace {

using enum Transport;

constexpr std::array kSchemes{
    BusScheme{kSocketCan, "", BusPlace::kInterface, false, "NAME", "vcan0",
              "SocketCAN: everything on Linux"},
    BusScheme{kSlcanTcp, "slcan-tcp:", BusPlace::kPort, false, "slcan-tcp:[ADDR:]PORT[?acks=no]",
              "slcan-tcp:29536",
              R"(python-can: interface="slcan", channel="socket://127.0.0.1:29536")"},
    BusScheme{kSlcanPty, "slcan-pty:", BusPlace::kPath, false, "slcan-pty:PATH",
              "slcan-pty:/tmp/ttyACM0",
              R"(python-can: interface="slcan", channel="/tmp/ttyACM0"; slcand)"},
    BusScheme{
        kSocketcand, "socketcand:", BusPlace::kPort, false, "socketcand:[ADDR:]PORT",
        "socketcand:29536",
        R"(python-can: interface="socketcand", channel="can0", host="127.0.0.1", port=29536)"},
    BusScheme{kUdpMulticast, "udp-multicast:", BusPlace::kGroup, false,
              "udp-multicast:[GROUP][:PORT][?ttl=1]", "udp-multicast:239.74.163.2",
              R"(python-can: interface="udp_multicast", channel="239.74.163.2", hop_limit=0)"},
    BusScheme{kRs485, "rs485:", BusPlace::kPath, true, "rs485:PATH", "rs485:/tmp/arm",
              R"(pyserial: serial.Serial("/tmp/arm", 115200))"},
    BusScheme{kRs485Tcp, "rs485-tcp:", BusPlace::kPort, true, "rs485-tcp:[ADDR:]PORT",
              "rs485-tcp:29485", R"(pyserial: serial.serial_for_url("socket://127.0.0.1:29485"))"},
};

/// Limit of a name in bytes, prefix included. The lock of a drive ID puts the name into a Unix
/// socket address, which has 108 bytes.
constexpr std::size_t kLongest = 90;
constexpr std::size_t kLongestInterface = 15;  // Linux: IFNAMSIZ without its zero
// Defaults of python-can's udp_multicast.
constexpr const char* kGroup = "ff15:7079:7468:6f6e:6465:6d6f:6d63:6173";
constexpr std::uint16_t kGroupPort = 43113;
constexpr std::string_view kNoAcks = "?acks=no";

bool is_printable(const std::string& name) {
  return std::ranges::all_of(name, [](char c) { return c > ' ' && c < '\x7f'; });
}

/// Returns the message for a name that has nothing after the prefix of its scheme.
std::string what_is_missing(const BusScheme& scheme) {
  const char* const what = scheme.place == BusPlace::kPath    ? "path"
                           : scheme.place == BusPlace::kGroup ? "group"
                                                              : "port";
  return std::string(scheme.prefix) + " needs a " + what + ", like " + std::string(scheme.example);
}

std::string interface_problem(const std::string& name) {
  if (name.empty()) return "an interface needs a name";
  const auto scheme = std::ranges::find(kSchemes, name + ":", &BusScheme::prefix);
  if (scheme != kSchemes.end()) return what_is_missing(*scheme);
  const std::size_t colon = name.find(':');
  if (colon != std::string::npos) {
    return "\"" + name + "\": unknown kind of bus \"" + name.substr(0, colon + 1) +
           "\"; examples: " + bus_examples();
  }
  if (name.size() > kLongestInterface) {
    return "\"" + name + "\" is longer than an interface name can be";
  }
  if (!is_printable(name) || name.find('/') != std::string::npos || name == "." || name == "..") {
    return "\"" + name + "\" is not an interface name";
  }
  return "";
}

/// Parses "[ADDR:]PORT" into `out`; without ADDR, `out.address` stays as it is. Returns the problem
/// or "".
std::string read_port(const std::string& name, std::string_view rest, BusName& out) {
  const std::string form(out.scheme->form);
  if (out.scheme->transport == kSlcanTcp && rest.ends_with(kNoAcks)) {
    out.acks = false;
    rest.remove_suffix(kNoAcks.size());
  }
  const std::size_t colon = rest.rfind(':');
  std::string_view digits = rest;
  if (colon != std::string_view::npos) {
    digits = rest.substr(colon + 1);
    const auto address = address_in(rest.substr(0, colon));
    if (!address) {
      return "\"" + name + "\" is not " + form + ": ADDR is an IP address, of IPv6 in brackets";
    }
    out.address = *address;
  }
  const auto port = number_of(digits, 10, 65535);
  if (!port || *port == 0) {
    return "\"" + name + "\" is not " + form + ": PORT is 1 to 65535, as in " +
           std::string(out.scheme->example);
  }
  out.port = static_cast<std::uint16_t>(*port);
  return "";
}

/// Parses "[GROUP][:PORT][?ttl=1]" into `out`. Returns the problem or "".
std::string read_group(const std::string& name, std::string_view rest, BusName& out) {
  const std::size_t question = rest.find('?');
  if (question != std::string_view::npos) {
    if (rest.substr(question) != "?ttl=1") {
      return "\"" + name + "\" is not " + std::string(out.scheme->form);
    }
    out.ttl = 1;
    rest = rest.substr(0, question);
  }
  out.address = kGroup;
  out.port = kGroupPort;
  if (const auto alone = address_in(rest)) {
    out.address = *alone;
  } else if (rest.starts_with(':')) {
    const std::string problem = read_port(name, rest.substr(1), out);
    if (!problem.empty()) return problem;
  } else if (!rest.empty()) {
    const std::string problem = read_port(name, rest, out);
    if (!problem.empty()) return problem;
  }
  return is_multicast(out.address)
             ? ""
             : "\"" + name + "\": " + out.address +
                   " is not a multicast group (224.0.0.0 to 239.255.255.255, or ff00::/8)";
}

}  // namespace

std::span<const BusScheme> bus_schemes() { return kSchemes; }

std::string bus_examples() {
  std::string all;
  for (const BusScheme& scheme : kSchemes) {
    all += (all.empty() ? "" : ", ") + std::string(scheme.example);
  }
  return all;
}

const BusScheme& scheme_of(std::string_view name) {
  const auto found = std::ranges::find_if(kSchemes, [&](const BusScheme& scheme) {
    return !scheme.prefix.empty() && name.starts_with(scheme.prefix);
  });
  return found != kSchemes.end() ? *found : kSchemes.front();
}

bool is_serial_name(std::string_view name) { return scheme_of(name).serial; }

std::variant<BusName, std::string> parse_bus_name(const std::string& name) {
  BusName out{&scheme_of(name)};
  const std::string rest = name.substr(out.scheme->prefix.size());
  std::string problem;
  if (out.scheme->place == BusPlace::kInterface) {
    problem = interface_problem(name);
  } else if (name.size() > kLongest) {
    problem = "\"" + name + "\" is longer than " + std::to_string(kLongest) + " characters";
  } else if (!is_printable(name)) {
    problem = "\"" + name + "\" has characters that a log could not show";
  } else if (out.scheme->place == BusPlace::kGroup) {
    problem = read_group(name, rest, out);
  } else if (rest.empty()) {
    problem = what_is_missing(*out.scheme);
  } else if (out.scheme->place == BusPlace::kPort) {
    out.address = kLoopback;
    problem = read_port(name, rest, out);
  }
  if (!problem.empty()) return problem;
  if (out.scheme->place == BusPlace::kInterface || out.scheme->place == BusPlace::kPath) {
    out.path = rest;
  }
  return out;
}

BusName bus_name(const std::string& name) {
  auto parsed = parse_bus_name(name);
  assert(std::holds_alternative<BusName>(parsed));
  return std::get<BusName>(std::move(parsed));
}

std::string bus_file_name(std::string name) {
  std::ranges::replace(name, '/', '_');
  return name;
}

}  // namespace lk::emulator
