#pragma once

#include <boost/asio/generic/stream_protocol.hpp>
#include <boost/beast/core/basic_stream.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/string_body.hpp>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <set>
#include <string>

#include "emulator/control/control_api.hpp"
#include "emulator/control/control_options.hpp"
#include "emulator/control/http_access.hpp"

namespace lk::emulator {

/// What all connections share. Outlives the server when connections do.
struct HttpShared {
  explicit HttpShared(World& world) : api(world) {}
  ControlApi api;
  double telemetry_values = 0;  // a second, of all streams
  int frame_streams = 0;
  int body_streams = 0;
};

/// One of the places that are listened at, and who is in by it: a crowd at one keeps nobody out at
/// another. Outlives the server when connections do.
struct Entrance {
  Access access;
  Patience patience;
  std::string page_language;  // as ControlOptions has it
  bool same_user = false;     // nobody else gets in
  int connections = 0;
  int streams = 0;  // of these, WebSockets, which are never idle
  /// Each closes one connection that waits for its next request; the longest wait first.
  std::list<std::function<void()>> idle;
  std::set<std::string> told;  // the kinds of refusal that the log has told of
};

// What a client may do, so that none can hurt the drives (docs/control.md).
inline constexpr int kMostConnections = 64;  // at each entrance
inline constexpr int kMostStreams = 48;      // of these: some places are left for newcomers
inline constexpr std::uint32_t kLongestHeader = 8 * 1024;
// A scenario is read on the loop of the drives: this much takes a few milliseconds.
inline constexpr std::uint64_t kLongestBody = 65'536;
/// Bytes of a WebSocket message of the client.
inline constexpr std::size_t kLongestMessage = 4096;

using HttpSocket = boost::asio::generic::stream_protocol::socket;
using HttpStream = boost::beast::basic_stream<boost::asio::generic::stream_protocol>;
/// What asks for a WebSocket.
using HttpUpgrade = boost::beast::http::request<boost::beast::http::string_body>;

/// Talks to one client until it has gone; keeps itself alive.
void serve_http(HttpSocket socket, std::shared_ptr<HttpShared> shared,
                std::shared_ptr<Entrance> entrance);

/// Says in the log that somebody was refused, and why: once for each `kind`, which is not for
/// clients to choose.
void tell_of_refusal(Entrance& entrance, const std::string& kind, const std::string& reason);

}  // namespace lk::emulator
