#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/udp.hpp>
#include <cstdint>
#include <functional>
#include <set>
#include <string>

#include "emulator/config/bus_name.hpp"
#include "emulator/transports/datagram_port.hpp"

namespace lk::emulator {

/// A bus of python-can's interface udp_multicast: every datagram to the group is a frame. The
/// network itself tells hosts of each other's frames, as an interface of CAN does.
class MulticastPort final : public DatagramPort {
 public:
  /// `name` is the bus's. `on_frames` is called when there may be something to `receive`. Throws
  /// StartError.
  MulticastPort(boost::asio::io_context& loop, const std::string& name, const BusName& group,
                std::function<void()> on_frames);

  /// Addresses of this machine may have changed.
  void check_link() override;
  void send(std::span<const protocol::Frame> frames) override;

 private:
  void take(std::span<const std::uint8_t> datagram, const Endpoint& from,
            std::vector<ReceivedFrame>& out) override;
  void join(const boost::asio::ip::address& group);
  /// It is of this machine, and not ours.
  bool counts(const Endpoint& sender);

  bool from_afar_;  // others may send as well
  Endpoint group_;
  boost::asio::ip::udp::socket sender_;  // of a port of its own, by which we know our datagrams
  std::uint16_t sender_port_ = 0;
  std::set<boost::asio::ip::address> own_addresses_;
};

}  // namespace lk::emulator
