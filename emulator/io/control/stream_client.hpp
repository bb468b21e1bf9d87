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

/// One WebSocket client of a stream; keeps itself alive until the client has gone.
class StreamClient : public std::enable_shared_from_this<StreamClient> {
 public:
  /// Takes `share` of the limit `used` of all clients.
  StreamClient(StreamPeer peer, double HttpShared::*used, double share);
  StreamClient(const StreamClient&) = delete;
  StreamClient& operator=(const StreamClient&) = delete;
  virtual ~StreamClient();

  /// Answers the upgrade, then calls `begin`.
  void start();

 protected:
  /// Called when the connection is open.
  virtual void begin() = 0;
  /// Called when `write` is done.
  virtual void on_written() = 0;
  /// Called when the client has gone, maybe twice: removes callbacks to this object.
  virtual void end() {}

  /// Pre: no other write is pending. `text` must stay unchanged until on_written or end.
  void write(const std::string& text);
  /// Calls `what` once unless the client has gone; replaces an earlier request.
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
