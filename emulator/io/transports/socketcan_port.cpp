#include "emulator/io/transports/socketcan_port.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <system_error>
#include <utility>

namespace lk::emulator {
namespace {

/// Replies kept while the queue is full: 0.1 s of a full bus. Later ones are useless to a host.
constexpr std::size_t kMaxPending = 1024;
constexpr auto kRetry = std::chrono::milliseconds(1);

}  // namespace

SocketCanPort::SocketCanPort(boost::asio::io_context& loop, std::string interface,
                             Interfaces allowed, Reception reception,
                             std::function<void()> on_frames)
    : interface_(std::move(interface)),
      allowed_(allowed),
      reception_(reception),
      on_frames_(std::move(on_frames)),
      readiness_(loop),
      retry_(loop) {}

void SocketCanPort::check_link() {
  try {
    update_link();
    if (socket_) open_error_logged_ = false;
  } catch (const std::system_error& problem) {
    // No descriptors are left, or the interface vanished: the next check tries again.
    if (!std::exchange(open_error_logged_, true)) {
      spdlog::warn("{}: cannot open: {}", interface_, problem.what());
    }
    if (!socket_ && link_ != Link::kMissing) enter(Link::kClosed);
  }
}

void SocketCanPort::update_link() {
  const LinkState link = link_state(interface_);
  if (link.index == 0 || !link.is_can) {
    close();
    enter(Link::kMissing);
    return;
  }
  if (!link.is_virtual() && allowed_ == Interfaces::kVirtualOnly) {
    close();
    enter(Link::kNotAllowed);
    return;
  }
  // Recreated under the same name, it is another interface: the old socket receives nothing.
  if (socket_ && link.index != index_) {
    close();
    enter(Link::kMissing);
  }
  if (!socket_) open(link.index);
  if (socket_) enter(link.up ? Link::kUp : Link::kDown);
}

void SocketCanPort::open(int index) {
  socket_.emplace(index, reception_);
  index_ = index;
  boost::system::error_code error;
  readiness_.assign(socket_->descriptor(), error);
  if (error) {
    socket_.reset();  // otherwise its frames would never be read
    throw std::system_error(error, "epoll");
  }
  wait_readable();
  // Asio makes the descriptor non-blocking. Calls that must not wait pass their own flag.
  socket_->set_blocking();
}

void SocketCanPort::close() {
  if (!socket_) return;
  readiness_.release();  // the socket closes its own descriptor
  retry_.cancel();
  ++generation_;
  waiting_to_flush_ = false;
  stats_.kernel_drops += socket_->kernel_drops();
  socket_.reset();
  drop_pending();
}

void SocketCanPort::enter(Link link) {
  if (link == link_) return;
  const Link before = std::exchange(link_, link);
  switch (link) {
    case Link::kUnknown:
    case Link::kClosed:  // the reason is already logged
      break;
    case Link::kUp:
      if (before != Link::kUnknown) spdlog::info("{} is up: continuing", interface_);
      break;
    case Link::kDown:
      spdlog::warn("{} is down: waiting for it (sudo ip link set {} up)", interface_, interface_);
      break;
    case Link::kMissing:
      log_missing();
      break;
    case Link::kNotAllowed:
      spdlog::warn(
          "{} is not a virtual interface any more: staying away from it, as real drives "
          "may be on it (to use it, start with --real-bus)",
          interface_);
      break;
  }
  if (link != Link::kUp) {
    if (before == Link::kUp) ++stats_.link_losses;
    drop_pending();
  }
}

/// A renamed interface is another one: the user does not expect drives under the new name.
void SocketCanPort::log_missing() const {
  const std::string name = index_ != 0 ? link_name(index_) : "";
  if (name.empty() || name == interface_) {
    spdlog::warn("{} is gone: waiting until it is created again", interface_);
  } else {
    spdlog::warn("{} was renamed to {}: waiting for a new {}", interface_, name, interface_);
  }
}

Port::Batch SocketCanPort::next_batch(Wait wait) {
  return socket_ ? socket_->receive(wait) : Batch{};
}

void SocketCanPort::note_error(int error) {
  spdlog::debug("{}: receive: {}", interface_, std::generic_category().message(error));
  // The socket has lost its interface; a new interface of that name needs a new socket.
  if (error == ENODEV) close();
  check_link();
}

void SocketCanPort::wait_readable() {
  readiness_.async_wait(boost::asio::posix::stream_descriptor::wait_read,
                        [this, mine = generation_](const auto& /*error*/) {
                          if (mine != generation_) return;
                          on_frames_();
                          if (mine == generation_) wait_readable();
                        });
}

void SocketCanPort::send(std::span<const protocol::Frame> frames) {
  if (!socket_ || link_ != Link::kUp) {
    stats_.lost_link_down += frames.size();
    return;
  }
  if (!waiting_to_flush_) send_out(frames);  // nothing is pending then
  const std::size_t kept = std::min(frames.size(), kMaxPending - pending_.size());
  pending_.insert(pending_.end(), frames.begin(),
                  frames.begin() + static_cast<std::ptrdiff_t>(kept));
  stats_.lost_queue_full += frames.size() - kept;
}

void SocketCanPort::send_out(std::span<const protocol::Frame>& frames) {
  if (frames.empty()) return;
  const CanSocket::Sent sent = socket_->send(frames);
  stats_.sent += sent.count;
  frames = frames.subspan(sent.count);
  switch (sent.then) {
    case SendResult::kSent:
      break;
    case SendResult::kNotWritable:
    case SendResult::kQueueFull:
      ++stats_.waits_for_queue;
      wait_to_flush(sent.then);
      break;
    case SendResult::kLinkDown:
      stats_.lost_link_down += frames.size();
      frames = {};
      break;
  }
}

void SocketCanPort::flush() {
  std::span<const protocol::Frame> frames = pending_;
  send_out(frames);
  pending_.erase(pending_.begin(), pending_.end() - static_cast<std::ptrdiff_t>(frames.size()));
}

void SocketCanPort::wait_to_flush(SendResult why) {
  waiting_to_flush_ = true;
  const auto go_on = [this, mine = generation_](const boost::system::error_code& /*error*/) {
    if (mine != generation_) return;
    waiting_to_flush_ = false;
    flush();
  };
  if (why == SendResult::kNotWritable) {
    readiness_.async_wait(boost::asio::posix::stream_descriptor::wait_write, go_on);
  } else {
    retry_.expires_after(kRetry);
    retry_.async_wait(go_on);
  }
}

void SocketCanPort::drop_pending() {
  stats_.lost_link_down += pending_.size();
  pending_.clear();
}

PortStats SocketCanPort::stats() const {
  PortStats stats = stats_;
  stats.pending = pending_.size();
  if (socket_) stats.kernel_drops += socket_->kernel_drops();
  return stats;
}

}  // namespace lk::emulator
