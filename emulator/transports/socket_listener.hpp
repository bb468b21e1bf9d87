#pragma once

#include <sys/types.h>

#include <boost/asio/basic_socket_acceptor.hpp>
#include <boost/asio/generic/stream_protocol.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

namespace lk::emulator {

/// Listens at a Unix socket or a TCP port and hands over those who connect. While there are no
/// descriptors left it tries again ten times a second.
class SocketListener {
 public:
  using Socket = boost::asio::generic::stream_protocol::socket;
  using OnConnect = std::function<void(Socket)>;

  /// A Unix socket that this user alone can open; the file goes with this. One that a dead process
  /// left there is replaced. Throws StartError.
  SocketListener(boost::asio::io_context& loop, const std::filesystem::path& path,
                 OnConnect on_connect);
  /// Port 0: any. Throws StartError.
  SocketListener(boost::asio::io_context& loop, const boost::asio::ip::address& address,
                 std::uint16_t port, OnConnect on_connect);
  SocketListener(const SocketListener&) = delete;
  SocketListener& operator=(const SocketListener&) = delete;
  ~SocketListener();

  /// Empty: TCP.
  const std::filesystem::path& path() const { return path_; }
  /// 0: a Unix socket.
  std::uint16_t port() const { return port_; }

 private:
  void accept();

  boost::asio::basic_socket_acceptor<boost::asio::generic::stream_protocol> acceptor_;
  boost::asio::steady_timer pause_;
  OnConnect on_connect_;
  std::filesystem::path path_;
  ino_t inode_ = 0;  // of our socket
  std::uint16_t port_ = 0;
};

/// As it stands in a URL: IPv6 in brackets.
std::string url_host(const boost::asio::ip::address& address);

}  // namespace lk::emulator
