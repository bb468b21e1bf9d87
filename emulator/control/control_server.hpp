#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/steady_timer.hpp>
#include <filesystem>
#include <memory>
#include <optional>

#include "emulator/control/control_options.hpp"
#include "emulator/control/http_session.hpp"

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
  ~ControlServer();

  ControlApi& api() { return shared_->api; }
  /// Empty: there is none.
  const std::filesystem::path& socket_path() const { return path_; }
  /// Of TCP; 0: there is none.
  unsigned port() const { return port_; }

 private:
  void listen_at(const std::filesystem::path& path);
  void listen_at(const HttpAddress& http, const ControlOptions& options);
  static bool has_room(Entrance& entrance);
  template <class Acceptor>
  void accept(Acceptor& acceptor, boost::asio::steady_timer& pause,
              std::shared_ptr<Entrance> entrance);

  boost::asio::io_context& loop_;
  std::shared_ptr<HttpShared> shared_;
  Patience patience_;
  std::optional<boost::asio::local::stream_protocol::acceptor> unix_;
  std::optional<boost::asio::ip::tcp::acceptor> tcp_;
  // When there are no descriptors left; each entrance its own, as a timer set anew forgets.
  boost::asio::steady_timer unix_pause_;
  boost::asio::steady_timer tcp_pause_;
  std::filesystem::path path_;
  unsigned long inode_ = 0;  // of our socket
  unsigned port_ = 0;
};

}  // namespace lk::emulator
