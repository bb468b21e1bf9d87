#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/udp.hpp>
#include <cstdint>
#include <functional>
#include <set>
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
  MulticastPort(boost::asio::io_context& loop, const std::string& name, const BusName& group,
                std::function<void()> on_frames);

  /// Addresses of this machine may have changed.
  void check_link() override;
  bool is_up() const override { return true; }
  bool can_wait() const override { return false; }
  void send(std::span<const protocol::Frame> frames) override;
  int descriptor() const override { return descriptor_; }
  std::size_t pending() const override { return 0; }
  PortStats stats() const override { return stats_; }

 private:
  Batch next_batch(Wait wait) override;
  void note_error(int /*error*/) override {}
  void join(const boost::asio::ip::address& group);
  void wait_readable();
  /// It is of this machine, and not ours.
  bool counts(const boost::asio::ip::udp::endpoint& sender);

  std::string name_;
  bool from_afar_;  // others may send as well
  std::function<void()> on_frames_;
  boost::asio::ip::udp::endpoint group_;
  boost::asio::ip::udp::socket receiver_;
  boost::asio::ip::udp::socket sender_;  // of a port of its own, by which we know our datagrams
  int descriptor_ = -1;
  std::uint16_t sender_port_ = 0;
  std::set<boost::asio::ip::address> own_addresses_;
  PortStats stats_;
  std::vector<std::uint8_t> bytes_;
  std::vector<ReceivedFrame> received_;
};

}  // namespace lk::emulator
