#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "emulator/config/bus_name.hpp"
#include "emulator/transports/cannelloni.hpp"
#include "emulator/transports/datagram_port.hpp"

namespace lk::emulator {

/// A bus at the other end of a cannelloni: the hosts there are on a CAN interface, or behind a
/// bridge, which tells them of each other's frames.
class CannelloniPort final : public DatagramPort {
 public:
  /// `name` is the bus's. `on_frames` is called when there may be something to `receive`. Throws
  /// StartError.
  CannelloniPort(boost::asio::io_context& loop, const std::string& name, const BusName& place,
                 std::function<void()> on_frames);

  void check_link() override {}
  void send(std::span<const protocol::Frame> frames) override;

 private:
  void take(std::span<const std::uint8_t> datagram, const Endpoint& from,
            std::vector<ReceivedFrame>& out) override;
  bool is_peer(const Endpoint& from);

  Endpoint peer_;
  std::uint8_t sequence_ = 0;  // of what is sent next
  PacketsMissed missed_;
};

}  // namespace lk::emulator
