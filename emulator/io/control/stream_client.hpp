#pragma once

#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <functional>
#include <memory>
#include <string>

#include "emulator/io/control/streams.hpp"

namespace lk::emulator {

/// One WebSocket client of a stream; owns itself until the client has disconnected.
class StreamClient : public std::enable_shared_from_this<StreamClient> {
 public:
  /// Adds `share` to the total `used` of all clients; the destructor subtracts it.
  StreamClient(StreamPeer peer, double HttpShared::*used, double share);
  StreamClient(const StreamClient&) = delete;
  StreamClient& operator=(const StreamClient&) = delete;
  virtual ~StreamClient();

  /// Answers the upgrade, then calls `begin`.
  void start();

 protected:
  /// Called once the WebSocket is open.
  virtual void begin() = 0;
  /// Called when `write` is done.
  virtual void on_written() = 0;
  /// Called when the client has disconnected, maybe twice. Must remove all callbacks to this
  /// object.
  virtual void end() {}

  /// Pre: no other write is pending. `text` must stay unchanged until on_written or end.
  void write(const std::string& text);
  /// Calls `what` once after `delay`, unless the client has disconnected by then. Cancels an
  /// earlier `do_after`.
  void do_after(std::chrono::nanoseconds delay, std::function<void()> what);
  World& world() const { return shared_->api.world(); }

 private:
  void read();
  void on_disconnect();

  boost::beast::websocket::stream<HttpStream, false> socket_;
  boost::asio::steady_timer timer_;
  std::shared_ptr<HttpShared> shared_;
  std::shared_ptr<HttpEndpoint> endpoint_;
  HttpUpgrade upgrade_;
  double HttpShared::*used_;
  double share_;
  boost::beast::flat_buffer incoming_;
  bool is_closed_ = false;
};

}  // namespace lk::emulator
