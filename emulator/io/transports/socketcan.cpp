#include "emulator/io/transports/socketcan.hpp"

#include <fcntl.h>
#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <system_error>

namespace lk::emulator {
namespace {

using std::chrono::nanoseconds;

constexpr std::size_t kBatch = 64;
constexpr int kReceiveBuffer = 4 << 20;  // bytes, about 5000 frames: over 0.5 s of a full bus

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

void set_filter(int fd, Reception reception) {
  if (reception == Reception::kEverything) return;  // the filter a raw socket starts with
  constexpr canid_t kExtendedBits = CAN_EFF_MASK & ~CAN_SFF_MASK;
  // Remote frames pass too (the masks omit their flag), to be counted.
  const std::array<can_filter, 4> filters = {{
      {0x140, 0x7C0 | CAN_EFF_FLAG},
      {0x140 | CAN_EFF_FLAG, kExtendedBits | 0x7C0 | CAN_EFF_FLAG},
      {0x280, 0x7F0 | CAN_EFF_FLAG},
      {0x280 | CAN_EFF_FLAG, kExtendedBits | 0x7F0 | CAN_EFF_FLAG},
  }};
  set_option(fd, SOL_CAN_RAW, CAN_RAW_FILTER, filters, "CAN_RAW_FILTER");
}

/// Without privileges, the system's limit applies.
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
void configure(int fd, Reception reception) {
  // Own frames stay out by default (CAN_RAW_RECV_OWN_MSGS): our replies have the identifiers of
  // queries, and our error frames come from no host.
  set_filter(fd, reception);
  enlarge_receive_buffer(fd);
  const can_err_mask_t all_errors = CAN_ERR_MASK;
  const int on = 1;
  set_option(fd, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, all_errors, "CAN_RAW_ERR_FILTER");
  set_option(fd, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, on, "CAN_RAW_FD_FRAMES");  // to count them
  set_option(fd, SOL_SOCKET, SO_TIMESTAMPNS, on, "SO_TIMESTAMPNS");
  set_option(fd, SOL_SOCKET, SO_RXQ_OVFL, on, "SO_RXQ_OVFL");
  const timeval timeout{0, CanSocket::kReceiveTimeout.count()};
  set_option(fd, SOL_SOCKET, SO_RCVTIMEO, timeout, "SO_RCVTIMEO");
}

}  // namespace

/// Arguments of sendmmsg, set up once.
struct CanSocket::Outgoing {
  std::array<can_frame, kBatch> frames{};
  std::array<iovec, kBatch> vectors{};
  std::array<mmsghdr, kBatch> messages{};

  Outgoing() {
    for (std::size_t i = 0; i < kBatch; ++i) {
      vectors[i] = {&frames[i], sizeof frames[i]};
      messages[i].msg_hdr.msg_iov = &vectors[i];
      messages[i].msg_hdr.msg_iovlen = 1;
    }
  }
};

/// Buffers for recvmmsg, set up once.
struct CanSocket::Buffers {
  struct Control {
    alignas(cmsghdr)
        std::array<char, CMSG_SPACE(sizeof(timespec)) + CMSG_SPACE(sizeof(std::uint32_t))> bytes;
  };
  std::array<canfd_frame, kBatch> frames{};
  std::array<Control, kBatch> controls{};
  std::array<iovec, kBatch> vectors{};
  std::array<mmsghdr, kBatch> messages{};
  std::array<ReceivedFrame, kBatch> received{};

  Buffers() {
    for (std::size_t i = 0; i < kBatch; ++i) {
      vectors[i] = {&frames[i], sizeof frames[i]};
      messages[i].msg_hdr.msg_iov = &vectors[i];
      messages[i].msg_hdr.msg_iovlen = 1;
      messages[i].msg_hdr.msg_control = controls[i].bytes.data();
    }
  }
};

CanSocket::CanSocket(int interface_index, Reception reception)
    : fd_(::socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC, CAN_RAW)),
      buffers_(std::make_unique<Buffers>()),
      outgoing_(std::make_unique<Outgoing>()) {
  if (fd_ < 0) throw std::system_error(errno, std::generic_category(), "CAN socket");
  try {
    configure(fd_, reception);
    sockaddr_can address{};
    address.can_family = AF_CAN;
    address.can_ifindex = interface_index;
    if (::bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) < 0) {
      throw std::system_error(errno, std::generic_category(), "bind");
    }
  } catch (...) {
    ::close(fd_);
    throw;
  }
}

CanSocket::~CanSocket() { ::close(fd_); }

// NOLINTNEXTLINE(readability-make-member-function-const): it changes the socket
void CanSocket::set_blocking() {
  const int flags = ::fcntl(fd_, F_GETFL);
  if (flags < 0 || ::fcntl(fd_, F_SETFL, flags & ~O_NONBLOCK) < 0) {
    throw std::system_error(errno, std::generic_category(), "fcntl");
  }
}

CanSocket::Batch CanSocket::receive(Wait wait) {
  for (auto& message : buffers_->messages) {
    message.msg_hdr.msg_controllen = sizeof(Buffers::Control::bytes);
  }
  const int flags = wait == Wait::kForOne ? MSG_WAITFORONE : MSG_DONTWAIT;
  const int count = ::recvmmsg(fd_, buffers_->messages.data(), kBatch, flags, nullptr);
  if (count < 0) {
    const bool nothing = errno == EAGAIN || errno == EINTR;
    return {{}, !nothing, nothing ? 0 : errno};
  }
  const auto received = static_cast<std::size_t>(count);
  for (std::size_t i = 0; i < received; ++i) {
    mmsghdr& message = buffers_->messages[i];
    ReceivedFrame& out = buffers_->received[i];
    out.frame = to_frame(buffers_->frames[i], message.msg_len);
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
  return {std::span(buffers_->received).first(received), received == kBatch, 0};
}

CanSocket::Sent CanSocket::send(std::span<const protocol::Frame> frames) {
  std::size_t done = 0;
  while (done < frames.size()) {
    const std::size_t sent = send_some(frames.subspan(done));
    if (sent == 0) return {done, why_not_sent(errno)};
    done += sent;
  }
  return {done, SendResult::kSent};
}

/// Sends as many frames as one system call takes. Returns 0 and sets errno if none is sent.
std::size_t CanSocket::send_some(std::span<const protocol::Frame> frames) {
  const std::size_t count = std::min(frames.size(), kBatch);
  Outgoing& out = *outgoing_;
  for (std::size_t i = 0; i < count; ++i) out.frames[i] = from_frame(frames[i]);
  if (count == 1) {
    return ::send(fd_, out.frames.data(), CAN_MTU, MSG_DONTWAIT) == CAN_MTU ? 1 : 0;
  }
  const int sent = ::sendmmsg(fd_, out.messages.data(), static_cast<unsigned>(count), MSG_DONTWAIT);
  return sent > 0 ? static_cast<std::size_t>(sent) : 0;
}

std::string can_problem() {
  const int fd = ::socket(PF_CAN, SOCK_RAW, CAN_RAW);
  if (fd >= 0) {
    ::close(fd);
    return "";
  }
  if (errno == EPERM || errno == EACCES) return "no permission to open a CAN socket";
  return "this kernel has no CAN sockets";
}

}  // namespace lk::emulator
