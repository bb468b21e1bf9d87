#pragma once

#include <sys/types.h>

#include <boost/asio/basic_socket_acceptor.hpp>
#include <boost/asio/generic/stream_protocol.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <set>
#include <string>

namespace lk::emulator {

/// Returns the addresses of all interfaces, without scopes; empty if the system does not report
/// them.
std::set<boost::asio::ip::address> addresses_of_this_machine();
/// Converts fe80::1%eth0 to fe80::1.
boost::asio::ip::address without_scope(const boost::asio::ip::address& address);

/// Limits log messages caused by others to twenty in ten seconds. Otherwise they could fill a disk,
/// or a log pipe that is not read, which would stop the program.
class LogLimit {
 public:
  /// Returns whether one more message may be logged, and counts it. Logs itself, with the prefix
  /// `whom`, that further messages are suppressed.
  bool may_log(const std::string& whom);

 private:
  std::chrono::steady_clock::time_point since_;
  unsigned logged_ = 0;
};

/// Listens at a Unix socket or a TCP port and passes connections to a callback. If it cannot accept
/// one, for lack of free descriptors, it retries ten times a second.
class SocketListener {
 public:
  using Socket = boost::asio::generic::stream_protocol::socket;
  using OnConnect = std::function<void(Socket)>;

  /// Opens a Unix socket at `path`, for this user only; the destructor removes its file. Replaces a
  /// socket that no process listens at any more. Throws StartError.
  SocketListener(boost::asio::io_context& loop, const std::filesystem::path& path,
                 OnConnect on_connect);
  /// Listens at a TCP port; 0: any free port. Throws StartError.
  SocketListener(boost::asio::io_context& loop, const boost::asio::ip::address& address,
                 std::uint16_t port, OnConnect on_connect);
  SocketListener(const SocketListener&) = delete;
  SocketListener& operator=(const SocketListener&) = delete;
  ~SocketListener();

  /// Path of the Unix socket; empty for TCP.
  const std::filesystem::path& path() const { return path_; }
  /// TCP port; 0 for a Unix socket.
  std::uint16_t port() const { return port_; }

 private:
  void accept();

  boost::asio::basic_socket_acceptor<boost::asio::generic::stream_protocol> acceptor_;
  boost::asio::steady_timer pause_;
  OnConnect on_connect_;
  std::filesystem::path path_;
  ino_t inode_ = 0;  // of the socket file
  std::uint16_t port_ = 0;
};

/// Returns the address as in a URL: IPv6 in brackets.
std::string url_host(const boost::asio::ip::address& address);

}  // namespace lk::emulator
