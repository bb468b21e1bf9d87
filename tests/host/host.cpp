#include "tests/host/host.hpp"

#include <arpa/inet.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <stdexcept>
#include <system_error>
#include <vector>

namespace lk::host {
namespace {

constexpr canid_t kSingleDriveId = 0x140;
constexpr int kPort = 29536;
const std::string kSlcan = "slcan-tcp:";

[[noreturn]] void fail(const char* what) {
  throw std::system_error(errno, std::generic_category(), what);
}

int can_socket(const std::string& interface, Host::Loopback loopback) {
  const int fd = ::socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC, CAN_RAW);
  if (fd < 0) fail("socket");
  const int on = 1;
  const int loop = loopback == Host::Loopback::kOn ? 1 : 0;
  const int room = 4 << 20;
  ::setsockopt(fd, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, &on, sizeof on);
  ::setsockopt(fd, SOL_CAN_RAW, CAN_RAW_LOOPBACK, &loop, sizeof loop);
  ::setsockopt(fd, SOL_SOCKET, SO_RCVBUFFORCE, &room, sizeof room);
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(::if_nametoindex(interface.c_str()));
  if (address.can_ifindex == 0) fail(interface.c_str());
  if (::bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) < 0) fail("bind");
  return fd;
}

int slcan_socket(const std::string& place) {
  const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (fd < 0) fail("socket");
  const int on = 1;
  ::setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  const auto colon = place.find(':');
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = ::inet_addr(place.substr(0, colon).c_str());
  address.sin_port = htons(static_cast<std::uint16_t>(std::stoi(place.substr(colon + 1))));
  if (::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) < 0) {
    fail(place.c_str());
  }
  return fd;
}

/// Ignores EPIPE: if the program has ended, the caller's wait for an answer fails.
void say(int fd, const std::string& line) {
  if (::send(fd, line.data(), line.size(), MSG_NOSIGNAL) < 0 && errno != EPIPE &&
      errno != ECONNRESET) {
    fail("send");
  }
}

std::string line_of(const can_frame& frame) {
  const bool extended = (frame.can_id & CAN_EFF_FLAG) != 0;
  const bool remote = (frame.can_id & CAN_RTR_FLAG) != 0;
  const char kind = extended ? (remote ? 'R' : 'T') : (remote ? 'r' : 't');
  char text[16];
  std::snprintf(text, sizeof text, extended ? "%c%08X%d" : "%c%03X%d", kind,
                frame.can_id & CAN_EFF_MASK, frame.len);
  std::string line = text;
  for (int n = 0; n < (remote ? 0 : frame.len); ++n) {
    std::snprintf(text, sizeof text, "%02X", frame.data[n]);
    line += text;
  }
  return line + '\r';
}

/// Parses a data frame with a standard identifier; drives and their hosts send no other frames.
can_frame frame_of(const std::string& line) {
  const auto number = [&line](std::size_t at, std::size_t digits) {
    return std::stoul(line.substr(at, digits), nullptr, 16);
  };
  can_frame frame{};
  frame.can_id = static_cast<canid_t>(number(1, 3));
  frame.len = static_cast<std::uint8_t>(number(4, 1));
  for (std::size_t n = 0; n < frame.len; ++n) {
    frame.data[n] = static_cast<std::uint8_t>(number(5 + 2 * n, 2));
  }
  return frame;
}

}  // namespace

std::string own_bus(int n) {
  const auto pid = static_cast<unsigned>(::getpid());  // below 2^22
  return kSlcan + "127." + std::to_string(64 + (pid >> 16)) + '.' +
         std::to_string(pid >> 8 & 0xFF) + '.' + std::to_string(pid & 0xFF) + ':' +
         std::to_string(kPort + n);
}

Host::Host(const std::string& bus, Loopback loopback) : slcan_(bus.starts_with(kSlcan)) {
  if (!slcan_) {
    fd_ = can_socket(bus, loopback);
    return;
  }
  fd_ = slcan_socket(bus.substr(kSlcan.size()));
  say(fd_, "O\r");
  char answer = 0;
  if (::recv(fd_, &answer, 1, 0) != 1 || answer != '\r') throw std::runtime_error("not opened");
}

Host::~Host() { ::close(fd_); }

void Host::send(canid_t id, const Payload& data) const {
  can_frame frame{};
  frame.can_id = id;
  frame.len = 8;
  std::copy(data.begin(), data.end(), frame.data);
  send(frame);
}

void Host::send(const can_frame& frame) const {
  if (slcan_) return say(fd_, line_of(frame));
  if (::write(fd_, &frame, sizeof frame) != sizeof frame) fail("write");
}

void Host::send(const canfd_frame& frame) const {
  if (::write(fd_, &frame, sizeof frame) != sizeof frame) fail("write");
}

void Host::hear_only(const std::vector<int>& ids) const {
  std::vector<can_filter> filters;
  for (const int id : ids) {
    filters.push_back({kSingleDriveId + static_cast<canid_t>(id), CAN_SFF_MASK});
  }
  const auto size = static_cast<socklen_t>(filters.size() * sizeof(can_filter));
  if (::setsockopt(fd_, SOL_CAN_RAW, CAN_RAW_FILTER, filters.data(), size) < 0) fail("filter");
  // Discards frames that arrived before the filter was set.
  for (canfd_frame early{}; ::recv(fd_, &early, sizeof early, MSG_DONTWAIT) > 0;) {
  }
}

void Host::hear_errors() const {
  const can_err_mask_t all = CAN_ERR_MASK;
  if (::setsockopt(fd_, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &all, sizeof all) < 0) fail("filter");
}

std::optional<can_frame> Host::receive(int patience_ms) {
  if (slcan_) return receive_line(patience_ms);
  pollfd readable{fd_, POLLIN, 0};
  if (::poll(&readable, 1, patience_ms) < 1) return std::nullopt;
  canfd_frame frame{};
  if (::read(fd_, &frame, sizeof frame) != sizeof(can_frame)) return std::nullopt;
  can_frame classic{};
  classic.can_id = frame.can_id;
  classic.len = frame.len;
  std::copy_n(frame.data, sizeof classic.data, classic.data);
  return classic;
}

std::optional<can_frame> Host::receive_line(int patience_ms) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::milliseconds(patience_ms);
  for (;;) {
    for (auto end = heard_.find('\r'); end != std::string::npos; end = heard_.find('\r')) {
      const std::string line = heard_.substr(0, end);
      heard_.erase(0, end + 1);
      if (line.starts_with('t')) return frame_of(line);  // other lines are acknowledgements
    }
    const auto left =
        std::chrono::ceil<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
    pollfd readable{fd_, POLLIN, 0};
    if (::poll(&readable, 1, std::max(0, static_cast<int>(left.count()))) < 1) return std::nullopt;
    char bytes[4096];
    const ssize_t size = ::recv(fd_, bytes, sizeof bytes, 0);
    if (size <= 0) return std::nullopt;
    heard_.append(bytes, static_cast<std::size_t>(size));
  }
}

std::optional<Payload> Host::query(int id, const Payload& data) {
  send(kSingleDriveId + static_cast<canid_t>(id), data);
  const auto reply = receive();
  if (!reply || reply->can_id != kSingleDriveId + static_cast<canid_t>(id) || reply->len != 8) {
    return std::nullopt;
  }
  Payload payload;
  std::copy_n(reply->data, payload.size(), payload.begin());
  return payload;
}

}  // namespace lk::host
