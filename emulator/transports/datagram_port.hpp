#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/udp.hpp>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "emulator/transports/port.hpp"

namespace lk::emulator {

/// A bus whose frames come in datagrams. Its hosts are told of each other's frames by who brings
/// them: the network, or what is behind it.
class DatagramPort : public Port {
 public:
  bool is_up() const override { return true; }
  bool can_wait() const override { return false; }
  int descriptor() const override { return descriptor_; }
  std::size_t pending() const override { return 0; }
  PortStats stats() const override { return stats_; }

 protected:
  using Endpoint = boost::asio::ip::udp::endpoint;

  /// A datagram of more than `longest` bytes is cut, to one byte more.
  DatagramPort(boost::asio::io_context& loop, std::string name, std::size_t longest,
               std::function<void()> on_frames);
  /// From now on, by `socket_`, which is open.
  void listen();
  /// What the datagram brings is appended to `out`; counted where it is none.
  virtual void take(std::span<const std::uint8_t> datagram, const Endpoint& from,
                    std::vector<ReceivedFrame>& out) = 0;

  std::string name_;
  boost::asio::ip::udp::socket socket_;
  PortStats stats_;

 private:
  Batch next_batch(Wait wait) override;
  void note_error(int /*error*/) override {}
  void wait_readable();

  std::function<void()> on_frames_;
  int descriptor_ = -1;
  std::vector<std::uint8_t> bytes_;
  std::vector<ReceivedFrame> received_;
};

}  // namespace lk::emulator
