#pragma once

#include <boost/asio/io_context.hpp>
#include <filesystem>
#include <memory>
#include <optional>

#include "emulator/io/control/control_options.hpp"
#include "emulator/io/control/http_session.hpp"
#include "emulator/io/transports/socket_listener.hpp"

namespace lk::emulator {

/// Serves the control interface of a running world (docs/reference/control-api.md) on the loop of
/// the world. No client can stop or delay the loop.
class ControlServer {
 public:
  /// Throws StartError if it cannot listen at an address in `options`. If options.socket is empty
  /// and the runtime directory is unusable, logs a warning and opens no Unix socket.
  ControlServer(boost::asio::io_context& loop, World& world, const ControlOptions& options);
  ControlServer(const ControlServer&) = delete;
  ControlServer& operator=(const ControlServer&) = delete;
  ~ControlServer() = default;

  ControlApi& api() { return shared_->api; }
  /// Path of the Unix socket; empty if there is none.
  std::filesystem::path socket_path() const { return unix_ ? unix_->path() : ""; }
  /// TCP port; 0 if there is none.
  unsigned port() const { return tcp_ ? tcp_->port() : 0; }

 private:
  void listen_at(const std::filesystem::path& path);
  void listen_at(const HttpAddress& http, const ControlOptions& options);
  static bool has_room(HttpEndpoint& endpoint);
  SocketListener::OnConnect serving(std::shared_ptr<HttpEndpoint> endpoint);

  boost::asio::io_context& loop_;
  std::shared_ptr<HttpShared> shared_;
  Timeouts timeouts_;
  std::optional<SocketListener> unix_;
  std::optional<SocketListener> tcp_;
};

}  // namespace lk::emulator
