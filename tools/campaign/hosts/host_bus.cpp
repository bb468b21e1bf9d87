#include "tools/campaign/hosts/host_bus.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>

#include "emulator/config/ip_address.hpp"
#include "emulator/files/json_table.hpp"
#include "emulator/ground/start_error.hpp"
#include "emulator/ground/text.hpp"

namespace lk::emulator {
namespace {

/// Of the documents' example: it stays on this machine.
constexpr const char* kGroup = "239.74.163.2";

}  // namespace

const std::vector<std::string_view>& host_bus_kinds() {
  static const std::vector<std::string_view> kinds = {
      "vcan", "slcan-tcp", "slcan-pty", "socketcand", "udp-multicast", "rs485", "rs485-tcp"};
  return kinds;
}

HostBus::HostBus(const std::string& kind, const std::filesystem::path& directory) {
  const std::string terminal = (directory / "tty").string();
  // python-can waits two seconds unless it is told not to.
  constexpr const char* kAtOnce = R"({"sleep_after_open": 0})";
  if (kind == "vcan") {
    own_network_ = true;
    name_ = channel_ = "vcan0";
    can_interface_ = "socketcan";
  } else if (kind == "slcan-tcp") {
    take_port(SOCK_STREAM);
    name_ = "slcan-tcp:" + port_;
    channel_ = std::string("socket://") + kLoopback + ":" + port_;
    can_interface_ = "slcan";
    can_config_ = kAtOnce;
  } else if (kind == "slcan-pty") {
    name_ = "slcan-pty:" + terminal;
    channel_ = terminal;
    can_interface_ = "slcan";
    can_config_ = kAtOnce;
  } else if (kind == "socketcand") {
    take_port(SOCK_STREAM);
    name_ = "socketcand:" + port_;
    channel_ = "can0";
    can_interface_ = "socketcand";
    can_config_ = Json{{"host", kLoopback}, {"port", std::stoi(port_)}}.dump();
  } else if (kind == "udp-multicast") {
    take_port(SOCK_DGRAM);
    name_ = std::string("udp-multicast:") + kGroup + ":" + port_;
    channel_ = kGroup;
    can_interface_ = "udp_multicast";
    can_config_ = Json{{"port", std::stoi(port_)}, {"hop_limit", 0}}.dump();
  } else if (kind == "rs485") {
    name_ = "rs485:" + terminal;
    channel_ = terminal;
  } else if (kind == "rs485-tcp") {
    take_port(SOCK_STREAM);
    name_ = "rs485-tcp:" + port_;
    channel_ = std::string("socket://") + kLoopback + ":" + port_;
  } else {
    const std::vector<std::string> kinds(host_bus_kinds().begin(), host_bus_kinds().end());
    throw StartError("host: bus: \"" + kind + "\" is not one of " + comma_list(kinds));
  }
}

/// A port that the system has chosen. The socket that is bound to it keeps it from being chosen
/// again; it does not listen, so whoever asks for this very port, and for reuse, gets it.
void HostBus::take_port(int type) {
  kept_ = Descriptor(::socket(AF_INET, type | SOCK_CLOEXEC, 0));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  auto* const any = reinterpret_cast<sockaddr*>(&address);
  const int yes = 1;
  if (!kept_ || ::bind(kept_.get(), any, size) != 0 ||
      ::getsockname(kept_.get(), any, &size) != 0 ||
      ::setsockopt(kept_.get(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes) != 0) {
    throw StartError("host: no port is to be had: " + reason_of(errno));
  }
  port_ = std::to_string(ntohs(address.sin_port));
}

std::vector<std::pair<std::string, std::string>> HostBus::environment() const {
  std::vector<std::pair<std::string, std::string>> all = {{"LKEMU_BUS", name_},
                                                          {"LKEMU_CHANNEL", channel_}};
  if (can_interface_.empty()) return all;
  all.emplace_back("CAN_INTERFACE", can_interface_);
  all.emplace_back("CAN_CHANNEL", channel_);
  all.emplace_back("CAN_CONFIG", can_config_.empty() ? "{}" : can_config_);
  return all;
}

}  // namespace lk::emulator
