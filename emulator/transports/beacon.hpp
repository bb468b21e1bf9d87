#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/ip/udp.hpp>
#include <chrono>
#include <cstdint>
#include <string>

namespace lk::emulator {

/// By which clients of socketcand find its ports: a datagram for all, every three seconds. Those of
/// a loopback address stay on this machine.
class Beacon {
 public:
  static constexpr std::uint16_t kPort = 42000;
  static constexpr auto kPause = std::chrono::seconds(3);

  /// `address` is of IPv4, and one of this machine's own.
  Beacon(boost::asio::io_context& loop, const boost::asio::ip::address_v4& address,
         std::uint16_t port);
  /// Sends it when it is time to. Call now and then.
  void look();

 private:
  boost::asio::ip::udp::socket socket_;
  boost::asio::ip::udp::endpoint all_;
  std::string text_;
  std::chrono::steady_clock::time_point next_;
};

/// What it says.
std::string beacon_text(const std::string& host, const std::string& address, std::uint16_t port);

}  // namespace lk::emulator
