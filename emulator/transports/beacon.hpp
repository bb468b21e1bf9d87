#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/ip/udp.hpp>
#include <chrono>
#include <cstdint>
#include <string>

namespace lk::emulator {

/// Announces a socketcand port to clients by a broadcast datagram every three seconds. Datagrams
/// from a loopback address stay on this machine.
class Beacon {
 public:
  static constexpr std::uint16_t kPort = 42000;
  static constexpr auto kPause = std::chrono::seconds(3);

  /// Pre: `address` is an IPv4 address of this machine.
  Beacon(boost::asio::io_context& loop, const boost::asio::ip::address_v4& address,
         std::uint16_t port);
  /// Sends the beacon if it is due. Call regularly.
  void look();

 private:
  boost::asio::ip::udp::socket socket_;
  boost::asio::ip::udp::endpoint all_;
  std::string text_;
  std::chrono::steady_clock::time_point next_;
};

/// Returns the text of the beacon.
std::string beacon_text(const std::string& host, const std::string& address, std::uint16_t port);

}  // namespace lk::emulator
