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

#include "emulator/transports/netlink.hpp"
#include "emulator/transports/socketcan.hpp"

namespace lk::emulator {

/// What a port has seen; frames by cause are the bus's to count.
struct PortStats {
  std::uint64_t kernel_drops = 0;  // frames the kernel had no room for
  std::uint64_t sent = 0;
  std::uint64_t lost_link_down = 0;   // replies that had no interface to leave by
  std::uint64_t lost_queue_full = 0;  // replies nobody took off our hands in time
  std::uint64_t pending = 0;          // replies in our hands still
  std::uint64_t waits_for_queue = 0;  // times the send queue was full
  std::uint64_t link_losses = 0;      // times the interface went down or away
};

/// One interface through thick and thin: it may go down, vanish and come back; frames go on flowing
/// when it does. Replies leave in order; a full send queue is waited for.
class SocketCanPort {
 public:
  /// `on_frames` is called when there may be something to `receive`. Call `check_link` to start.
  SocketCanPort(boost::asio::io_context& loop, std::string interface, Interfaces allowed,
                Reception reception, std::function<void()> on_frames);

  SocketCanPort(const SocketCanPort&) = delete;
  SocketCanPort& operator=(const SocketCanPort&) = delete;
  // NOLINTNEXTLINE(bugprone-exception-escape): a timer and a descriptor of ours can be let go of
  ~SocketCanPort() { close(); }

  /// Looks at the interface and follows it: at the start, whenever the kernel reports a change, and
  /// now and then, as what could not be opened may be opened later.
  void check_link();
  bool is_up() const { return link_ == Link::kUp; }

  /// Hands `take(std::span<const ReceivedFrame>)` what has arrived, up to a bound that keeps the
  /// loop responsive; returns whether that ended it. Waits for the first if that is asked for.
  template <typename Take>
  bool receive(Take&& take, CanSocket::Wait wait = CanSocket::Wait::kNot) {
    constexpr int kMostBatches = 16;
    for (int i = 0; socket_ && i < kMostBatches; ++i) {
      const CanSocket::Batch batch = socket_->receive(i == 0 ? wait : CanSocket::Wait::kNot);
      if (!batch.frames.empty()) take(batch.frames);
      if (batch.error != 0) note_error(batch.error);
      if (!batch.more) return false;
    }
    return socket_.has_value();
  }

  void send(std::span<const protocol::Frame> frames);

  const std::string& interface() const { return interface_; }
  /// To wait for frames; −1: there is no socket.
  int descriptor() const { return socket_ ? socket_->descriptor() : -1; }
  /// Replies in our hands still.
  std::size_t pending() const { return pending_.size(); }
  PortStats stats() const;

 private:
  enum class Link : std::uint8_t { kUnknown, kMissing, kNotAllowed, kClosed, kDown, kUp };

  void follow_link();
  void open(int index);
  void close();
  void enter(Link link);
  void say_missing() const;
  void note_error(int error);
  void wait_readable();
  /// Takes those that left off the front.
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
  unsigned generation_ = 0;  // of the socket: what waited for an earlier one is void
  Link link_ = Link::kUnknown;
  int index_ = 0;  // of the interface the socket is at, or was last
  bool told_of_trouble_ = false;
  PortStats stats_;
};

}  // namespace lk::emulator
