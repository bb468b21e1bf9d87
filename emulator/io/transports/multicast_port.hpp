#pragma once

/// Buses of python-can's udp_multicast interface. A datagram has the attributes of one CAN message
/// in MessagePack.

#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "emulator/config/bus_name.hpp"
#include "emulator/io/transports/port.hpp"
#include "protocol/frame.hpp"

namespace lk::emulator {

/// Limit for a datagram in bytes; CAN 2.0 messages of python-can have about 170.
inline constexpr std::size_t kLongestCanMsgpack = 512;

/// Returns nullopt if the bytes are malformed. Returns CAN FD and error frames without their data.
std::optional<protocol::Frame> parse_can_msgpack(std::span<const std::uint8_t> bytes);
/// Returns the datagram for `frame`. `stamp` is a reading of the wall clock.
std::vector<std::uint8_t> can_msgpack(const protocol::Frame& frame, std::chrono::nanoseconds stamp);

/// Creates the port of such a bus: every datagram to `group` is a frame. The network delivers a
/// host's frames to the other hosts, as a CAN interface does. `name`: name of the bus. Throws
/// StartError.
std::unique_ptr<Port> make_multicast_port(boost::asio::io_context& loop, const std::string& name,
                                          const BusName& group, std::function<void()> on_frames);

}  // namespace lk::emulator
