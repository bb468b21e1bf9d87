#include "emulator/io/transports/netlink.hpp"

#include <linux/if_link.h>
#include <linux/netlink.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <spdlog/spdlog.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <map>
#include <span>
#include <string_view>
#include <system_error>
#include <vector>

#include "emulator/files/durable_file.hpp"

namespace lk::emulator {
namespace {

constexpr auto kPollPeriod = std::chrono::seconds(1);

[[noreturn]] void throw_errno(int error, const std::string& what) {
  throw std::system_error(error, std::generic_category(), what);
}

/// Bytes. The kernel's answer about one interface has about 1 KiB, without its traffic counters.
constexpr std::size_t kLongestAnswer = 16384;

/// Returns the result in the kernel's answer to a request: 0 or an errno.
int verdict(std::span<const std::uint8_t> answer) {
  nlmsgerr verdict{};
  if (answer.size() < NLMSG_HDRLEN + sizeof verdict) return EPROTO;
  std::memcpy(&verdict, answer.data() + NLMSG_HDRLEN, sizeof verdict);
  return -verdict.error;
}

/// A netlink request, built up attribute by attribute.
class Request {
 public:
  Request(std::uint16_t type, std::uint16_t flags, const ifinfomsg& info) {
    header_.nlmsg_type = type;
    header_.nlmsg_flags = flags;
    header_.nlmsg_seq = 1;
    append(&header_, sizeof header_);
    append(&info, sizeof info);
  }
  void add(std::uint16_t type, std::string_view text) {
    const std::size_t start = open(type);
    append(text.data(), text.size());
    close(start);
  }
  /// Starts an attribute. Pass the result to `close`, which ends the attribute.
  std::size_t open(std::uint16_t type) {
    const std::size_t start = bytes_.size();
    const rtattr attribute{0, type};
    append(&attribute, sizeof attribute);
    return start;
  }
  void close(std::size_t start) {
    const auto length = static_cast<std::uint16_t>(bytes_.size() - start);
    std::memcpy(&bytes_[start], &length, sizeof length);
    bytes_.resize(NLMSG_ALIGN(bytes_.size()));
  }
  /// Sends the request and returns the kernel's answer: data or an error code.
  std::vector<std::uint8_t> ask() {
    header_.nlmsg_len = static_cast<std::uint32_t>(bytes_.size());
    std::memcpy(bytes_.data(), &header_, sizeof header_);
    const Descriptor socket(::socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC, NETLINK_ROUTE));
    if (!socket) throw_errno(errno, "socket");
    if (::send(socket.get(), bytes_.data(), bytes_.size(), 0) < 0) throw_errno(errno, "netlink");
    std::vector<std::uint8_t> answer(kLongestAnswer);
    const ssize_t size = ::recv(socket.get(), answer.data(), answer.size(), MSG_TRUNC);
    if (size < 0) throw_errno(errno, "netlink");
    if (static_cast<std::size_t>(size) > answer.size()) throw_errno(EMSGSIZE, "netlink");
    answer.resize(static_cast<std::size_t>(size));
    return answer;
  }
  /// Sends the request and returns the kernel's result: 0 or an errno.
  int execute() { return verdict(ask()); }

 private:
  void append(const void* data, std::size_t size) {
    const auto* begin = static_cast<const std::uint8_t*>(data);
    bytes_.insert(bytes_.end(), begin, begin + size);
  }

  nlmsghdr header_{};
  std::vector<std::uint8_t> bytes_;
};

constexpr std::uint16_t kTypeBits = 0xFFFF & NLA_TYPE_MASK;

/// Attributes in `bytes`, by type; omits truncated attributes.
using Attributes = std::map<std::uint16_t, std::span<const std::uint8_t>>;
Attributes attributes_in(std::span<const std::uint8_t> bytes) {
  Attributes all;
  rtattr attribute{};
  while (bytes.size() >= sizeof attribute) {
    std::memcpy(&attribute, bytes.data(), sizeof attribute);
    if (attribute.rta_len < sizeof attribute || attribute.rta_len > bytes.size()) break;
    all[attribute.rta_type & kTypeBits] =
        bytes.subspan(sizeof attribute, attribute.rta_len - sizeof attribute);
    bytes = bytes.subspan(std::min<std::size_t>(NLMSG_ALIGN(attribute.rta_len), bytes.size()));
  }
  return all;
}

std::string text_of(const Attributes& attributes, std::uint16_t type) {
  const auto found = attributes.find(type);
  if (found == attributes.end()) return {};
  return {found->second.begin(), std::ranges::find(found->second, 0)};
}

int attribute_number(const Attributes& attributes, std::uint16_t type) {
  const auto found = attributes.find(type);
  int number = 0;
  if (found == attributes.end() || found->second.size() < sizeof number) return 0;
  std::memcpy(&number, found->second.data(), sizeof number);
  return number;
}

LinkState read_link(std::span<const std::uint8_t> answer) {
  ifinfomsg info{};
  std::memcpy(&info, answer.data() + NLMSG_HDRLEN, sizeof info);
  const Attributes attributes = attributes_in(answer.subspan(NLMSG_SPACE(sizeof info)));
  LinkState link;
  link.index = info.ifi_index;
  link.is_can = info.ifi_type == ARPHRD_CAN;
  link.up = (info.ifi_flags & IFF_UP) != 0;
  link.name = text_of(attributes, IFLA_IFNAME);
  if (const auto nested = attributes.find(IFLA_LINKINFO); nested != attributes.end()) {
    link.kind = text_of(attributes_in(nested->second), IFLA_INFO_KIND);
  }
  // With IFLA_LINK_NETNSID, IFLA_LINK is an index in another namespace.
  if (link.kind == "vxcan" && !attributes.contains(IFLA_LINK_NETNSID)) {
    link.peer = attribute_number(attributes, IFLA_LINK);
  }
  return link;
}

ifinfomsg bring_up(int index) {
  ifinfomsg info{};
  info.ifi_index = index;
  info.ifi_flags = IFF_UP;
  info.ifi_change = IFF_UP;
  return info;
}

int make_vcan(const std::string& interface) {
  Request request(RTM_NEWLINK, NLM_F_REQUEST | NLM_F_ACK | NLM_F_CREATE | NLM_F_EXCL, bring_up(0));
  request.add(IFLA_IFNAME, std::string_view(interface.c_str(), interface.size() + 1));
  const std::size_t link_info = request.open(IFLA_LINKINFO);
  request.add(IFLA_INFO_KIND, "vcan");
  request.close(link_info);
  return request.execute();
}

}  // namespace

LinkState link_state(const std::string& interface) {
  Request request(RTM_GETLINK, NLM_F_REQUEST, {});
  request.add(IFLA_IFNAME, std::string_view(interface.c_str(), interface.size() + 1));
  const std::vector<std::uint8_t> answer = request.ask();
  nlmsghdr header{};
  std::memcpy(&header, answer.data(), std::min(answer.size(), sizeof header));
  if (header.nlmsg_type == RTM_NEWLINK && answer.size() >= NLMSG_SPACE(sizeof(ifinfomsg))) {
    return read_link(answer);
  }
  const int error = verdict(answer);
  if (error != ENODEV) throw_errno(error, interface);
  return {};
}

void create_vcan(const std::string& interface) {
  const LinkState link = link_state(interface);
  if (link.up) return;
  const int error =
      link.index == 0
          ? make_vcan(interface)
          : Request(RTM_NEWLINK, NLM_F_REQUEST | NLM_F_ACK, bring_up(link.index)).execute();
  if (error != 0) throw_errno(error, interface);
}

std::string link_name(int index) {
  std::array<char, IF_NAMESIZE> name{};
  return ::if_indextoname(static_cast<unsigned>(index), name.data()) != nullptr ? name.data() : "";
}

int open_link_socket() {
  const int fd = ::socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, NETLINK_ROUTE);
  if (fd < 0) throw_errno(errno, "netlink socket");
  sockaddr_nl address{};
  address.nl_family = AF_NETLINK;
  address.nl_groups = RTMGRP_LINK;
  if (::bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) < 0) {
    const int error = errno;
    ::close(fd);
    throw_errno(error, "netlink bind");
  }
  return fd;
}

LinkMonitor::LinkMonitor(boost::asio::io_context& loop, std::function<void()> on_change, int socket)
    : socket_(loop, socket), poll_timer_(loop), on_change_(std::move(on_change)) {
  wait();
  poll();
}

void LinkMonitor::wait() {
  socket_.async_wait(boost::asio::posix::stream_descriptor::wait_read,
                     [this](const boost::system::error_code& error) {
                       if (error == boost::asio::error::operation_aborted) return;
                       const int broken = error ? error.value() : drain();
                       on_change_();
                       if (broken == 0) {
                         wait();
                         return;
                       }
                       // Does not wait again: a broken socket stays readable.
                       spdlog::warn("netlink: {}; interfaces are polled every second",
                                    std::generic_category().message(broken));
                     });
}

void LinkMonitor::poll() {
  poll_timer_.expires_after(kPollPeriod);
  poll_timer_.async_wait([this](const boost::system::error_code& error) {
    if (error) return;
    on_change_();
    poll();
  });
}

int LinkMonitor::drain() {
  std::array<char, 8192> ignored;
  for (;;) {
    const ssize_t size = ::recv(socket_.native_handle(), ignored.data(), ignored.size(), MSG_TRUNC);
    if (size == 0) return EPIPE;  // the kernel never closes its side
    // ENOBUFS: messages were lost, which does no harm: `on_change` is called anyway.
    if (size > 0 || errno == ENOBUFS || errno == EINTR) continue;
    return errno == EAGAIN ? 0 : errno;
  }
}

}  // namespace lk::emulator
