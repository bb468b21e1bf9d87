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

#include "emulator/io/control/control_api.hpp"
#include "emulator/io/control/control_options.hpp"
#include "emulator/io/control/http_access.hpp"

namespace lk::emulator {

/// State shared by all connections; may outlive the server.
struct HttpShared {
  explicit HttpShared(World& world) : api(world) {}
  ControlApi api;
  // Totals over all open streams; StreamClient updates them.
  double telemetry_values = 0;  // per second
  double frame_streams = 0;
  double body_streams = 0;
};

/// A listening address (Unix socket or TCP) and its connections. Each endpoint has its own limits,
/// so that clients of one cannot block another. May outlive the server.
struct HttpEndpoint {
  Access access;
  Timeouts timeouts;
  std::string page_language;  // see ControlOptions
  bool same_user = false;     // only the user of this process can connect
  int connections = 0;
  int streams = 0;  // WebSockets among the connections; never in `idle`
  /// Functions that each close one idle connection; the longest idle one is first.
  std::list<std::function<void()>> idle;
  std::set<std::string> logged_refusals;  // kinds of refusal already logged
};

// Limits that protect the drives from clients (docs/reference/control-api.md).
inline constexpr int kMaxConnections = 64;  // at each endpoint
inline constexpr int kMaxStreams = 48;  // of the connections; the other 16 stay free for requests
inline constexpr std::uint32_t kLongestHeader = 8 * 1024;  // bytes
// Bytes. A scenario is parsed on the loop of the drives: this size takes a few milliseconds.
inline constexpr std::uint64_t kLongestBody = 65'536;
/// Limit for a WebSocket message from a client, bytes.
inline constexpr std::size_t kLongestMessage = 4096;

using HttpSocket = boost::asio::generic::stream_protocol::socket;
using HttpStream = boost::beast::basic_stream<boost::asio::generic::stream_protocol>;
/// A request for an upgrade to WebSocket.
using HttpUpgrade = boost::beast::http::request<boost::beast::http::string_body>;

/// Serves the client at `socket` until it disconnects. The session owns itself.
void serve_http(HttpSocket socket, std::shared_ptr<HttpShared> shared,
                std::shared_ptr<HttpEndpoint> endpoint);

/// Logs a refusal and its reason, once for each `kind`. Pre: clients cannot choose the text of
/// `kind`, else they could fill log and memory.
void log_refusal(HttpEndpoint& endpoint, const std::string& kind, const std::string& reason);

}  // namespace lk::emulator
