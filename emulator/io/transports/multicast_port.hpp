#pragma once

/// Datagrams of python-can's udp_multicast interface: message attributes in MessagePack.

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/udp.hpp>
#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "emulator/config/bus_name.hpp"
#include "emulator/io/transports/port.hpp"
#include "protocol/frame.hpp"

namespace lk::emulator {

/// Upper limit in bytes; python-can's CAN 2.0 messages have about 170.
inline constexpr std::size_t kLongestCanMsgpack = 512;

/// Returns nullopt if the bytes are no message. CAN FD and error frames lose their data.
std::optional<protocol::Frame> parse_can_msgpack(std::span<const std::uint8_t> bytes);
/// `stamp` is a reading of the wall clock.
std::vector<std::uint8_t> can_msgpack(const protocol::Frame& frame, std::chrono::nanoseconds stamp);

/// A bus of python-can's udp_multicast interface: every datagram to the group is a frame. The
/// network delivers a host's frames to the other hosts, as a CAN interface does.
class MulticastPort final : public Port {
 public:
  /// `name` is the bus's. `on_frames` is called when there may be something to `receive`. Throws
  /// StartError.
  MulticastPort(boost::asio::io_context& loop, std::string name, const BusName& group,
                std::function<void()> on_frames);

  /// Reads the addresses of this machine again, as they may have changed.
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
  /// Appends the frame in `datagram` to `received_`, or counts it as malformed.
  void take(std::span<const std::uint8_t> datagram, const Endpoint& from);
  /// Returns whether to accept `sender`: not this port; another machine only if `accepts_remote_`.
  bool accepts(const Endpoint& sender);

  std::string name_;
  boost::asio::ip::udp::socket socket_;
  std::function<void()> on_frames_;
  PortStats stats_;
  int descriptor_ = -1;
  std::vector<std::uint8_t> bytes_;
  std::vector<ReceivedFrame> received_;
  bool accepts_remote_;  // accepts datagrams of other machines
  Endpoint group_;
  boost::asio::ip::udp::socket sender_;  // has its own port number, which marks our datagrams
  std::uint16_t sender_port_ = 0;
  std::set<boost::asio::ip::address> own_addresses_;
};

}  // namespace lk::emulator
