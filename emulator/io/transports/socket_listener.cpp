#include "emulator/io/transports/socket_listener.hpp"

#include <ifaddrs.h>
#include <netinet/in.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <chrono>
#include <cstring>
#include <memory>
#include <string>
#include <utility>

#include "emulator/core/start_error.hpp"
#include "emulator/files/runtime_dir.hpp"
#include "emulator/io/transports/client_set.hpp"

namespace lk::emulator {

namespace ip = boost::asio::ip;

std::set<ip::address> addresses_of_this_machine() {
  std::set<ip::address> found;
  ifaddrs* list = nullptr;
  if (::getifaddrs(&list) != 0) return found;
  const std::unique_ptr<ifaddrs, decltype(&::freeifaddrs)> owner(list, ::freeifaddrs);
  for (const ifaddrs* one = list; one != nullptr; one = one->ifa_next) {
    if (one->ifa_addr == nullptr) continue;
    if (one->ifa_addr->sa_family == AF_INET) {
      sockaddr_in address{};
      std::memcpy(&address, one->ifa_addr, sizeof address);
      found.insert(ip::address_v4(ntohl(address.sin_addr.s_addr)));
    } else if (one->ifa_addr->sa_family == AF_INET6) {
      sockaddr_in6 address{};
      std::memcpy(&address, one->ifa_addr, sizeof address);
      ip::address_v6::bytes_type bytes;
      std::memcpy(bytes.data(), &address.sin6_addr, bytes.size());
      found.insert(ip::address_v6(bytes));  // without its scope
    }
  }
  return found;
}

ip::address without_scope(const ip::address& address) {
  return address.is_v6() ? ip::address(ip::address_v6(address.to_v6().to_bytes())) : address;
}

bool LogLimit::may_log(const std::string& whom) {
  constexpr unsigned kMax = 20;
  constexpr auto kWindow = std::chrono::seconds(10);
  const auto now = std::chrono::steady_clock::now();
  if (logged_ == 0 || now - since_ > kWindow) {
    since_ = now;
    logged_ = 0;
  }
  ++logged_;
  if (logged_ == kMax + 1)
    spdlog::warn("{}: further messages of this kind are suppressed for a while", whom);
  return logged_ <= kMax;
}

namespace {

using boost::asio::ip::tcp;
using boost::asio::local::stream_protocol;
using boost::system::error_code;

constexpr std::size_t kLongestPath = 107;  // bytes in sun_path, without the final zero
constexpr auto kPause = std::chrono::milliseconds(100);

}  // namespace

SocketListener::SocketListener(boost::asio::io_context& loop, const std::filesystem::path& path,
                               OnConnect on_connect)
    : acceptor_(loop), pause_(loop), on_connect_(std::move(on_connect)) {
  const std::string name = path.string();
  if (name.size() > kLongestPath) {
    throw StartError(name + " is longer than the path of a socket can be (" +
                     std::to_string(kLongestPath) + ")");
  }
  clear_stale_socket(path);
  error_code error;
  acceptor_.open(stream_protocol{}, error);
  if (!error) {
    const mode_t before = ::umask(0177);  // mode 0600 from the start: no other user can connect
    acceptor_.bind(stream_protocol::endpoint(name), error);
    ::umask(before);
  }
  if (!error) {
    path_ = path;
    struct stat made {};
    ::lstat(name.c_str(), &made);
    inode_ = made.st_ino;
    acceptor_.listen(boost::asio::socket_base::max_listen_connections, error);
  }
  if (error) throw StartError("cannot listen at " + name + ": " + error.message());
  accept();
}

SocketListener::SocketListener(boost::asio::io_context& loop,
                               const boost::asio::ip::address& address, std::uint16_t port,
                               OnConnect on_connect)
    : acceptor_(loop), pause_(loop), on_connect_(std::move(on_connect)) {
  const tcp::endpoint endpoint(address, port);
  try {
    acceptor_.open(endpoint.protocol());
    acceptor_.set_option(tcp::acceptor::reuse_address(true));
    acceptor_.bind(endpoint);
    acceptor_.listen();
    keep_connections_alive(acceptor_.native_handle());
    const auto bound = acceptor_.local_endpoint();
    tcp::endpoint here;
    here.resize(bound.size());
    std::memcpy(here.data(), bound.data(), bound.size());
    port_ = here.port();
  } catch (const boost::system::system_error& problem) {
    throw StartError("cannot listen at " + url_host(address) + ":" + std::to_string(port) + ": " +
                     problem.code().message());
  }
  accept();
}

SocketListener::~SocketListener() {
  struct stat found {};
  // Removes the file only if it is still this socket.
  if (!path_.empty() && ::lstat(path_.c_str(), &found) == 0 && found.st_ino == inode_) {
    ::unlink(path_.c_str());
  }
}

void SocketListener::accept() {
  acceptor_.async_accept([this](const error_code& error, Socket socket) {
    if (error == boost::asio::error::operation_aborted) return;
    if (error) {
      // Most likely too many descriptors are open: retry later.
      pause_.expires_after(kPause);
      pause_.async_wait([this](const error_code& aborted) {
        if (!aborted) accept();
      });
      return;
    }
    error_code ignored;
    if (path_.empty()) socket.set_option(tcp::no_delay(true), ignored);
    on_connect_(std::move(socket));
    accept();
  });
}

std::string url_host(const boost::asio::ip::address& address) {
  return address.is_v6() ? "[" + address.to_string() + "]" : address.to_string();
}

}  // namespace lk::emulator
