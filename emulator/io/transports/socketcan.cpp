#include "emulator/io/transports/socketcan.hpp"

#include <fcntl.h>
#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <spdlog/spdlog.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <boost/asio/steady_timer.hpp>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <optional>
#include <system_error>
#include <utility>
#include <vector>

#include "emulator/files/durable_file.hpp"

namespace lk::emulator {
namespace {

using std::chrono::nanoseconds;

constexpr std::size_t kBatch = 64;
constexpr int kReceiveBuffer = 4 << 20;  // bytes, about 5000 frames: over 0.5 s of a full bus

/// Limit of replies kept while the send queue is full: 0.1 s of a full bus. A reply that waits
/// longer is useless to a host.
constexpr std::size_t kMaxPending = 1024;
constexpr auto kRetry = std::chrono::milliseconds(1);

enum class SendResult : std::uint8_t {
  kSent,
  kNotWritable,  // the socket's send buffer is full; poll reports when it has room
  kQueueFull,    // the interface's send queue is full; no event reports room
  kLinkDown,
};

nanoseconds to_nanoseconds(const timespec& time) {
  return std::chrono::seconds(time.tv_sec) + nanoseconds(time.tv_nsec);
}

protocol::Frame to_frame(const canfd_frame& raw, std::size_t size) {
  protocol::Frame frame;
  frame.extended = (raw.can_id & CAN_EFF_FLAG) != 0;
  frame.id = raw.can_id & (frame.extended ? CAN_EFF_MASK : CAN_SFF_MASK);
  if ((raw.can_id & CAN_ERR_FLAG) != 0) {
    frame.kind = protocol::FrameKind::kError;
  } else if (size == CANFD_MTU) {
    frame.kind = protocol::FrameKind::kFd;
  } else if ((raw.can_id & CAN_RTR_FLAG) != 0) {
    frame.kind = protocol::FrameKind::kRemote;
  }
  frame.dlc = std::min<std::uint8_t>(raw.len, CAN_MAX_DLEN);
  std::copy_n(raw.data, frame.dlc, frame.data.begin());
  return frame;
}

can_frame from_frame(const protocol::Frame& frame) {
  can_frame raw{};
  raw.can_id = frame.id | (frame.extended ? CAN_EFF_FLAG : 0U);
  if (frame.kind == protocol::FrameKind::kError) raw.can_id |= CAN_ERR_FLAG;
  raw.len = frame.dlc;
  std::copy_n(frame.data.begin(), CAN_MAX_DLEN, raw.data);
  return raw;
}

template <typename Value>
void set_option(int fd, int level, int name, const Value& value, const char* what) {
  if (::setsockopt(fd, level, name, &value, sizeof value) < 0) {
    throw std::system_error(errno, std::generic_category(), what);
  }
}

/// Sets a kernel filter: only identifiers 0x140..0x17F and 0x280..0x28F pass, also those of
/// extended and remote frames.
void pass_drive_frames_only(int fd) {
  constexpr canid_t kExtendedBits = CAN_EFF_MASK & ~CAN_SFF_MASK;
  // Remote frames pass too, as the masks omit CAN_RTR_FLAG: the bus counts them.
  const std::array<can_filter, 4> filters = {{
      {0x140, 0x7C0 | CAN_EFF_FLAG},
      {0x140 | CAN_EFF_FLAG, kExtendedBits | 0x7C0 | CAN_EFF_FLAG},
      {0x280, 0x7F0 | CAN_EFF_FLAG},
      {0x280 | CAN_EFF_FLAG, kExtendedBits | 0x7F0 | CAN_EFF_FLAG},
  }};
  set_option(fd, SOL_CAN_RAW, CAN_RAW_FILTER, filters, "CAN_RAW_FILTER");
}

/// Sets kReceiveBuffer; without privileges, the kernel reduces it to the system's limit.
void enlarge_receive_buffer(int fd) {
  if (::setsockopt(fd, SOL_SOCKET, SO_RCVBUFFORCE, &kReceiveBuffer, sizeof kReceiveBuffer) == 0)
    return;
  set_option(fd, SOL_SOCKET, SO_RCVBUF, kReceiveBuffer, "SO_RCVBUF");
}

SendResult why_not_sent(int error) {
  switch (error) {
    case EAGAIN:
    case EINTR:
      return SendResult::kNotWritable;
    case ENOBUFS:
      return SendResult::kQueueFull;
    default:
      return SendResult::kLinkDown;
  }
}

/// Sets all options except the interface. Throws std::system_error.
void configure(int fd, bool has_wire) {
  // By default a socket does not receive its own frames (CAN_RAW_RECV_OWN_MSGS). It must not: our
  // replies have the identifiers of queries, and our error frames come from no host.
  if (!has_wire) pass_drive_frames_only(fd);  // with a wire, all frames pass: each takes time
  enlarge_receive_buffer(fd);
  const can_err_mask_t all_errors = CAN_ERR_MASK;
  const int on = 1;
  set_option(fd, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, all_errors, "CAN_RAW_ERR_FILTER");
  set_option(fd, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, on, "CAN_RAW_FD_FRAMES");  // the bus counts them
  set_option(fd, SOL_SOCKET, SO_TIMESTAMPNS, on, "SO_TIMESTAMPNS");
  set_option(fd, SOL_SOCKET, SO_RXQ_OVFL, on, "SO_RXQ_OVFL");
  const timeval timeout{0, Port::kReceiveTimeout.count()};
  set_option(fd, SOL_SOCKET, SO_RCVTIMEO, timeout, "SO_RCVTIMEO");
}

/// Buffers for recvmmsg or sendmmsg, set up once for all calls.
template <typename Raw>
struct Messages {
  std::array<Raw, kBatch> frames{};
  std::array<iovec, kBatch> vectors{};
  std::array<mmsghdr, kBatch> messages{};

  Messages() {
    for (std::size_t i = 0; i < kBatch; ++i) {
      vectors[i] = {&frames[i], sizeof frames[i]};
      messages[i].msg_hdr.msg_iov = &vectors[i];
      messages[i].msg_hdr.msg_iovlen = 1;
    }
  }
};

/// A raw CAN socket bound to one interface. Blocks only in a `receive` with kForOne.
class CanSocket {
 public:
  /// `has_wire`: frames take time on the modelled wire. Throws std::system_error; the interface may
  /// be down.
  CanSocket(int interface_index, bool has_wire)
      : fd_(::socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC, CAN_RAW)) {
    if (!fd_) throw std::system_error(errno, std::generic_category(), "CAN socket");
    configure(fd_.get(), has_wire);
    sockaddr_can address{};
    address.can_family = AF_CAN;
    address.can_ifindex = interface_index;
    if (::bind(fd_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) < 0) {
      throw std::system_error(errno, std::generic_category(), "bind");
    }
    for (std::size_t i = 0; i < kBatch; ++i) {
      in_.messages[i].msg_hdr.msg_control = controls_[i].bytes.data();
    }
  }
  CanSocket(const CanSocket&) = delete;
  CanSocket& operator=(const CanSocket&) = delete;
  ~CanSocket() = default;

  int descriptor() const { return fd_.get(); }
  /// Number of frames that the kernel dropped because the receive buffer was full.
  std::uint32_t kernel_drops() const { return kernel_drops_; }

  /// Restores blocking mode, which `receive` with kForOne needs: an event loop may have changed it.
  /// Throws std::system_error.
  void set_blocking() const {
    const int flags = ::fcntl(fd_.get(), F_GETFL);
    if (flags < 0 || ::fcntl(fd_.get(), F_SETFL, flags & ~O_NONBLOCK) < 0) {
      throw std::system_error(errno, std::generic_category(), "fcntl");
    }
  }

  /// Returns received frames, up to kBatch. With `kForOne`, waits for a first frame.
  Port::Batch receive(Port::Wait wait) {
    for (auto& message : in_.messages) {
      message.msg_hdr.msg_controllen = sizeof(Control::bytes);
    }
    const int flags = wait == Port::Wait::kForOne ? MSG_WAITFORONE : MSG_DONTWAIT;
    const int count = ::recvmmsg(fd_.get(), in_.messages.data(), kBatch, flags, nullptr);
    if (count < 0) {
      const bool nothing = errno == EAGAIN || errno == EINTR;
      return {{}, !nothing, nothing ? 0 : errno};
    }
    const auto received = static_cast<std::size_t>(count);
    for (std::size_t i = 0; i < received; ++i) {
      mmsghdr& message = in_.messages[i];
      ReceivedFrame& out = received_[i];
      out.frame = to_frame(in_.frames[i], message.msg_len);
      out.stamp = nanoseconds(0);
      for (cmsghdr* item = CMSG_FIRSTHDR(&message.msg_hdr); item != nullptr;
           item = CMSG_NXTHDR(&message.msg_hdr, item)) {
        if (item->cmsg_level != SOL_SOCKET) continue;
        if (item->cmsg_type == SCM_TIMESTAMPNS) {
          timespec stamp{};
          std::memcpy(&stamp, CMSG_DATA(item), sizeof stamp);
          out.stamp = to_nanoseconds(stamp);
        } else if (item->cmsg_type == SO_RXQ_OVFL) {
          std::memcpy(&kernel_drops_, CMSG_DATA(item), sizeof kernel_drops_);
        }
      }
    }
    return {std::span(received_).first(received), received == kBatch, 0};
  }

  struct Sent {
    std::size_t count;  // frames sent, from the first on
    SendResult then;    // why the next frame was not sent; kSent: all were sent
  };
  Sent send(std::span<const protocol::Frame> frames) {
    std::size_t done = 0;
    while (done < frames.size()) {
      const std::size_t sent = send_some(frames.subspan(done));
      if (sent == 0) return {done, why_not_sent(errno)};
      done += sent;
    }
    return {done, SendResult::kSent};
  }

 private:
  struct Control {
    alignas(cmsghdr)
        std::array<char, CMSG_SPACE(sizeof(timespec)) + CMSG_SPACE(sizeof(std::uint32_t))> bytes;
  };

  /// Sends as many frames as one system call takes. Returns 0 and sets errno if none is sent.
  std::size_t send_some(std::span<const protocol::Frame> frames) {
    const std::size_t count = std::min(frames.size(), kBatch);
    for (std::size_t i = 0; i < count; ++i) out_.frames[i] = from_frame(frames[i]);
    if (count == 1) {
      return ::send(fd_.get(), out_.frames.data(), CAN_MTU, MSG_DONTWAIT) == CAN_MTU ? 1 : 0;
    }
    const int sent =
        ::sendmmsg(fd_.get(), out_.messages.data(), static_cast<unsigned>(count), MSG_DONTWAIT);
    return sent > 0 ? static_cast<std::size_t>(sent) : 0;
  }

  Descriptor fd_;
  std::uint32_t kernel_drops_ = 0;
  Messages<canfd_frame> in_;
  Messages<can_frame> out_;
  std::array<Control, kBatch> controls_{};
  std::array<ReceivedFrame, kBatch> received_{};
};

class SocketCanPort final : public Port {
 public:
  SocketCanPort(boost::asio::io_context& loop, const BusConfig& bus, Interfaces allowed,
                std::function<void()> on_frames)
      : interface_(bus.interface),
        allowed_(allowed),
        has_wire_(bus.bitrate > 0),
        readiness_(loop, std::move(on_frames)),
        retry_(loop) {}
  SocketCanPort(const SocketCanPort&) = delete;
  SocketCanPort& operator=(const SocketCanPort&) = delete;
  // NOLINTNEXTLINE(bugprone-exception-escape): releasing our own timer and descriptor cannot fail
  ~SocketCanPort() override { close(); }

  bool is_up() const override { return link_ == Link::kUp; }
  bool can_wait() const override { return true; }
  int descriptor() const override { return socket_ ? socket_->descriptor() : -1; }
  std::size_t pending() const override { return pending_.size(); }

  void check_link() override {
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

  void send(std::span<const protocol::Frame> frames) override {
    if (!socket_ || link_ != Link::kUp) {
      stats_.lost_link_down += frames.size();
      return;
    }
    if (!waiting_to_flush_) send_out(frames);  // otherwise earlier replies are pending
    const std::size_t kept = std::min(frames.size(), kMaxPending - pending_.size());
    pending_.insert(pending_.end(), frames.begin(),
                    frames.begin() + static_cast<std::ptrdiff_t>(kept));
    stats_.lost_queue_full += frames.size() - kept;
  }

  PortStats stats() const override {
    PortStats stats = stats_;
    stats.pending = pending_.size();
    if (socket_) stats.kernel_drops += socket_->kernel_drops();
    return stats;
  }

 private:
  enum class Link : std::uint8_t { kUnknown, kMissing, kNotAllowed, kClosed, kDown, kUp };

  Batch next_batch(Wait wait) override { return socket_ ? socket_->receive(wait) : Batch{}; }

  void note_error(int error) override {
    spdlog::debug("{}: receive: {}", interface_, std::generic_category().message(error));
    // ENODEV: the interface was removed. A new interface of the same name needs a new socket.
    if (error == ENODEV) close();
    check_link();
  }

  void update_link() {
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
    // Another index: the interface was removed and created again, and the old socket is useless.
    if (socket_ && link.index != index_) {
      close();
      enter(Link::kMissing);
    }
    if (!socket_) open(link.index);
    if (socket_) enter(link.up ? Link::kUp : Link::kDown);
  }

  void open(int index) {
    socket_.emplace(index, has_wire_);
    index_ = index;
    if (const auto error = readiness_.watch(socket_->descriptor())) {
      socket_.reset();  // without events its frames would never be read
      throw std::system_error(error, "epoll");
    }
    // Asio has made the descriptor non-blocking. Calls that must not wait pass MSG_DONTWAIT.
    socket_->set_blocking();
  }

  void close() {
    if (!socket_) return;
    readiness_.release();
    retry_.cancel();
    ++closed_;
    waiting_to_flush_ = false;
    stats_.kernel_drops += socket_->kernel_drops();
    socket_.reset();
    drop_pending();
  }

  void enter(Link link) {
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

  /// Logs that the interface is gone. A renamed one counts as gone: the user does not expect drives
  /// under the new name.
  void log_missing() const {
    const std::string name = index_ != 0 ? link_name(index_) : "";
    if (name.empty() || name == interface_) {
      spdlog::warn("{} is gone: waiting until it is created again", interface_);
    } else {
      spdlog::warn("{} was renamed to {}: waiting for a new {}", interface_, name, interface_);
    }
  }

  void send_out(std::span<const protocol::Frame>& frames) {
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

  void flush() {
    std::span<const protocol::Frame> frames = pending_;
    send_out(frames);
    pending_.erase(pending_.begin(), pending_.end() - static_cast<std::ptrdiff_t>(frames.size()));
  }

  void wait_to_flush(SendResult why) {
    waiting_to_flush_ = true;
    const auto go_on = [this] {
      waiting_to_flush_ = false;
      flush();
    };
    if (why == SendResult::kNotWritable) {
      readiness_.when_writable(go_on);
    } else {
      retry_.expires_after(kRetry);
      retry_.async_wait([go_on, this, mine = closed_](const boost::system::error_code& error) {
        if (!error && mine == closed_) go_on();
      });
    }
  }

  void drop_pending() {
    stats_.lost_link_down += pending_.size();
    pending_.clear();
  }

  std::string interface_;
  Interfaces allowed_;
  bool has_wire_;
  std::optional<CanSocket> socket_;
  Readiness readiness_;  // of the socket
  boost::asio::steady_timer retry_;
  std::vector<protocol::Frame> pending_;
  bool waiting_to_flush_ = false;
  unsigned closed_ = 0;  // number of sockets closed so far; their timers are ignored
  Link link_ = Link::kUnknown;
  int index_ = 0;  // of the present or last interface
  bool open_error_logged_ = false;
  PortStats stats_;
};

}  // namespace

std::string can_problem() {
  const int fd = ::socket(PF_CAN, SOCK_RAW, CAN_RAW);
  if (fd >= 0) {
    ::close(fd);
    return "";
  }
  if (errno == EPERM || errno == EACCES) return "no permission to open a CAN socket";
  return "this kernel has no CAN sockets";
}

std::unique_ptr<Port> make_socketcan_port(boost::asio::io_context& loop, const BusConfig& bus,
                                          Interfaces allowed, std::function<void()> on_frames) {
  return std::make_unique<SocketCanPort>(loop, bus, allowed, std::move(on_frames));
}

}  // namespace lk::emulator
