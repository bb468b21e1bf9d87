#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "emulator/io/transports/netlink.hpp"
#include "emulator/io/transports/port.hpp"
#include "emulator/io/transports/socketcan.hpp"

namespace lk::emulator {

/// One CAN interface, which may go down, vanish and come back; the frames then flow again. Replies
/// leave in order and wait while the send queue is full.
class SocketCanPort final : public Port {
 public:
  /// `on_frames` is called when there may be something to `receive`. Call `check_link` to start.
  SocketCanPort(boost::asio::io_context& loop, std::string interface, Interfaces allowed,
                Reception reception, std::function<void()> on_frames);
  SocketCanPort(const SocketCanPort&) = delete;
  SocketCanPort& operator=(const SocketCanPort&) = delete;
  // NOLINTNEXTLINE(bugprone-exception-escape): a timer and a descriptor of ours can be let go of
  ~SocketCanPort() override { close(); }

  void check_link() override;
  bool is_up() const override { return link_ == Link::kUp; }
  bool can_wait() const override { return true; }
  void send(std::span<const protocol::Frame> frames) override;

  const std::string& interface() const { return interface_; }
  int descriptor() const override { return socket_ ? socket_->descriptor() : -1; }
  std::size_t pending() const override { return pending_.size(); }
  PortStats stats() const override;

 private:
  enum class Link : std::uint8_t { kUnknown, kMissing, kNotAllowed, kClosed, kDown, kUp };

  void update_link();
  void open(int index);
  void close();
  void enter(Link link);
  void log_missing() const;
  Batch next_batch(Wait wait) override;
  void note_error(int error) override;
  void wait_readable();
  /// Sends frames and removes the sent ones from the front.
  void send_out(std::span<const protocol::Frame>& frames);
  void flush();
  void wait_to_flush(SendResult why);
  void drop_pending();

  std::string interface_;
  Interfaces allowed_;
  Reception reception_;
  std::function<void()> on_frames_;
  std::optional<CanSocket> socket_;
  boost::asio::posix::stream_descriptor
      readiness_;  // watches the socket, which owns the descriptor
  boost::asio::steady_timer retry_;
  std::vector<protocol::Frame> pending_;
  bool waiting_to_flush_ = false;
  unsigned generation_ = 0;  // of the socket; callbacks of earlier sockets are ignored
  Link link_ = Link::kUnknown;
  int index_ = 0;  // of the socket's current or last interface
  bool open_error_logged_ = false;
  PortStats stats_;
};

}  // namespace lk::emulator
