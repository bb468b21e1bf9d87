#pragma once

#include <boost/asio/generic/stream_protocol.hpp>
#include <memory>

#include "emulator/control/control_api.hpp"
#include "emulator/control/http_access.hpp"

namespace lk::emulator {

/// What all connections share. Outlives the server when connections do.
struct HttpShared {
  explicit HttpShared(World& world) : api(world) {}
  ControlApi api;
  int connections = 0;
  double telemetry_values = 0;  // a second, of all streams
};

// What a client may do, so that none can hurt the drives (docs/control.md).
inline constexpr int kMostConnections = 64;
inline constexpr std::uint32_t kLongestHeader = 8 * 1024;
inline constexpr std::uint64_t kLongestBody = 64 * 1024;
inline constexpr std::uint64_t kLongestScenario = 1024 * 1024;
inline constexpr auto kRequestDeadline = std::chrono::seconds(10);
inline constexpr auto kLongestIdle = std::chrono::seconds(60);

using HttpSocket = boost::asio::generic::stream_protocol::socket;

/// Talks to one client until it has gone; keeps itself alive.
void serve_http(HttpSocket socket, std::shared_ptr<HttpShared> shared,
                std::shared_ptr<const Access> access);

}  // namespace lk::emulator
