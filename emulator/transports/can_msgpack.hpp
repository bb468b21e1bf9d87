#pragma once

/// Datagrams of python-can's udp_multicast interface: message attributes in MessagePack.

#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "protocol/frame.hpp"

namespace lk::emulator {

/// Upper limit in bytes; python-can's CAN 2.0 messages have about 170.
inline constexpr std::size_t kLongestCanMsgpack = 512;

/// Returns nullopt if the bytes are no message. CAN FD and error frames lose their data.
std::optional<protocol::Frame> parse_can_msgpack(std::span<const std::uint8_t> bytes);
/// `stamp` is a reading of the wall clock.
std::vector<std::uint8_t> can_msgpack(const protocol::Frame& frame, std::chrono::nanoseconds stamp);

}  // namespace lk::emulator
