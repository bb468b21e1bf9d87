#pragma once

#include <boost/asio/io_context.hpp>
#include <filesystem>
#include <memory>
#include <optional>

#include "emulator/control/control_options.hpp"
#include "emulator/control/http_session.hpp"
#include "emulator/transports/socket_listener.hpp"

namespace lk::emulator {

/// Lets people and programs look at a running world and act on it: docs/control.md. On the loop of
/// the world; no client can stop that, or make it wait.
class ControlServer {
 public:
  /// Throws StartError when it cannot listen where it was told to. Where nothing was said and the
  /// runtime directory will not do, it says so and goes without.
  ControlServer(boost::asio::io_context& loop, World& world, const ControlOptions& options);
  ControlServer(const ControlServer&) = delete;
  ControlServer& operator=(const ControlServer&) = delete;
  ~ControlServer() = default;

  ControlApi& api() { return shared_->api; }
  /// Empty: there is none.
  std::filesystem::path socket_path() const { return unix_ ? unix_->path() : ""; }
  /// Of TCP; 0: there is none.
  unsigned port() const { return tcp_ ? tcp_->port() : 0; }

 private:
  void listen_at(const std::filesystem::path& path);
  void listen_at(const HttpAddress& http, const ControlOptions& options);
  static bool has_room(Entrance& entrance);
  SocketListener::OnConnect serving(std::shared_ptr<Entrance> entrance);

  boost::asio::io_context& loop_;
  std::shared_ptr<HttpShared> shared_;
  Patience patience_;
  std::optional<SocketListener> unix_;
  std::optional<SocketListener> tcp_;
};

}  // namespace lk::emulator
