#include "emulator/transports/beacon.hpp"

#include <fmt/format.h>

#include <boost/asio/buffer.hpp>
#include <boost/asio/ip/host_name.hpp>

namespace lk::emulator {

using boost::asio::ip::address_v4;
using boost::asio::ip::udp;

std::string beacon_text(const std::string& host, const std::string& address, std::uint16_t port) {
  return fmt::format(
      "<CANBeacon name=\"{}\" type=\"SocketCAN\" description=\"lk-emu\">\n"
      "<URL>can://{}:{}</URL><Bus name=\"can0\"/></CANBeacon>",
      host, address, port);
}

Beacon::Beacon(boost::asio::io_context& loop, const address_v4& address, std::uint16_t port)
    : socket_(loop),
      all_(address.is_loopback() ? address_v4({127, 255, 255, 255}) : address_v4::broadcast(),
           kPort) {
  boost::system::error_code error;
  const std::string host = boost::asio::ip::host_name(error);
  text_ = beacon_text(error ? "localhost" : host, address.to_string(), port);
  // A failed send is ignored: a client that knows the address needs no beacon.
  socket_.open(udp::v4(), error);
  socket_.set_option(boost::asio::socket_base::broadcast(true), error);
  socket_.bind({address, 0}, error);
  socket_.non_blocking(true, error);
}

void Beacon::look() {
  const auto now = std::chrono::steady_clock::now();
  if (now < next_) return;
  next_ = now + kPause;
  boost::system::error_code error;
  socket_.send_to(boost::asio::buffer(text_), all_, 0, error);
}

}  // namespace lk::emulator
