#pragma once

#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <functional>
#include <memory>
#include <string>

#include "emulator/control/http_session.hpp"

namespace lk::emulator {

/// One client of a stream, over a WebSocket; keeps itself alive until it has gone.
class StreamClient : public std::enable_shared_from_this<StreamClient> {
 public:
  StreamClient(HttpStream stream, std::shared_ptr<HttpShared> shared,
               std::shared_ptr<Entrance> entrance);
  StreamClient(const StreamClient&) = delete;
  StreamClient& operator=(const StreamClient&) = delete;
  virtual ~StreamClient();

  /// Answers the upgrade and begins.
  void start(HttpUpgrade upgrade);

 protected:
  /// It is there.
  virtual void begin() = 0;
  /// `write` is done.
  virtual void on_written() = 0;
  /// It has gone: what calls it is to be taken back. Comes again.
  virtual void end() = 0;

  /// `text` stays as it is until on_written or end; one at a time.
  void write(const std::string& text);
  /// `what` once, unless it has gone by then; in place of what was to be done before.
  void do_after(std::chrono::nanoseconds delay, std::function<void()> what);
  HttpShared& shared() const { return *shared_; }

 private:
  void read();
  void leave();

  boost::beast::websocket::stream<HttpStream, false> socket_;
  boost::asio::steady_timer timer_;
  std::shared_ptr<HttpShared> shared_;
  std::shared_ptr<Entrance> entrance_;
  HttpUpgrade upgrade_;
  boost::beast::flat_buffer incoming_;
  bool gone_ = false;
};

}  // namespace lk::emulator
