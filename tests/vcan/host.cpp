#include "tests/vcan/host.hpp"

#include <linux/can/raw.h>
#include <net/if.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>
#include <vector>

namespace lk::vcan {
namespace {

constexpr canid_t kSingleDriveId = 0x140;

[[noreturn]] void fail(const char* what) {
  throw std::system_error(errno, std::generic_category(), what);
}

}  // namespace

Host::Host(const std::string& interface, Loopback loopback)
    : fd_(::socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC, CAN_RAW)) {
  if (fd_ < 0) fail("socket");
  const int on = 1;
  const int loop = loopback == Loopback::kOn ? 1 : 0;
  const int room = 4 << 20;
  ::setsockopt(fd_, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, &on, sizeof on);
  ::setsockopt(fd_, SOL_CAN_RAW, CAN_RAW_LOOPBACK, &loop, sizeof loop);
  ::setsockopt(fd_, SOL_SOCKET, SO_RCVBUFFORCE, &room, sizeof room);
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(::if_nametoindex(interface.c_str()));
  if (address.can_ifindex == 0) fail(interface.c_str());
  if (::bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) < 0) fail("bind");
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
  // Others may have talked before the filter was there.
  for (canfd_frame early{}; ::recv(fd_, &early, sizeof early, MSG_DONTWAIT) > 0;) {
  }
}

std::optional<can_frame> Host::receive(int patience_ms) {
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

}  // namespace lk::vcan
