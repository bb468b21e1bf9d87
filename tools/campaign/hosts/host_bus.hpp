#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "emulator/files/durable_file.hpp"

namespace lk::emulator {

/// The kinds of bus that a case can have for itself: "vcan", "slcan-tcp", …
const std::vector<std::string_view>& host_bus_kinds();

/// A bus that nobody else has, for as long as this lives.
class HostBus {
 public:
  /// What it needs of files is in `directory`. Throws StartError when it cannot be had.
  HostBus(const std::string& kind, const std::filesystem::path& directory);

  const std::string& name() const { return name_; }        // "slcan-tcp:40001"
  const std::string& channel() const { return channel_; }  // what a host opens
  const std::string& port() const { return port_; }        // empty: it has none
  bool own_network() const { return own_network_; }  // it is in a network namespace of its own
  /// By which a host finds it.
  std::vector<std::pair<std::string, std::string>> environment() const;

 private:
  void take_port(int type);

  std::string name_, channel_, port_;
  std::string can_interface_, can_config_;  // python-can's; empty: it is not for python-can
  bool own_network_ = false;
  Descriptor kept_;  // keeps the port from being given to others
};

}  // namespace lk::emulator
