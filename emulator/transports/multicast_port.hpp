#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/udp.hpp>
#include <cstdint>
#include <functional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "emulator/config/bus_name.hpp"
#include "emulator/transports/port.hpp"

namespace lk::emulator {

/// A bus of python-can's interface udp_multicast: every datagram to the group is a frame. The
/// network itself tells hosts of each other's frames, as an interface of CAN does.
class MulticastPort final : public Port {
 public:
  /// `name` is the bus's. `on_frames` is called when there may be something to `receive`. Throws
  /// StartError.
  MulticastPort(boost::asio::io_context& loop, std::string name, const BusName& group,
                std::function<void()> on_frames);

  /// Addresses of this machine may have changed.
  void check_link() override;
  bool is_up() const override { return true; }
  bool can_wait() const override { return false; }
  int descriptor() const override { return descriptor_; }
  void send(std::span<const protocol::Frame> frames) override;
  std::size_t pending() const override { return 0; }
  PortStats stats() const override { return stats_; }

 private:
  using Endpoint = boost::asio::ip::udp::endpoint;

  Batch next_batch(Wait wait) override;
  void note_error(int /*error*/) override {}
  void join(const boost::asio::ip::address& group);
  void wait_readable();
  /// The frame in `datagram` is appended to `received_`, or counted as malformed.
  void take(std::span<const std::uint8_t> datagram, const Endpoint& from);
  /// It is of this machine, and not ours.
  bool counts(const Endpoint& sender);

  std::string name_;
  boost::asio::ip::udp::socket socket_;
  std::function<void()> on_frames_;
  PortStats stats_;
  int descriptor_ = -1;
  std::vector<std::uint8_t> bytes_;
  std::vector<ReceivedFrame> received_;
  bool from_afar_;  // others may send as well
  Endpoint group_;
  boost::asio::ip::udp::socket sender_;  // of a port of its own, by which we know our datagrams
  std::uint16_t sender_port_ = 0;
  std::set<boost::asio::ip::address> own_addresses_;
};

}  // namespace lk::emulator
