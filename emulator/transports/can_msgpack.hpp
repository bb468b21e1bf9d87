#pragma once

/// @file The datagrams of python-can's interface udp_multicast: a message's attributes in
/// MessagePack.

#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "protocol/frame.hpp"

namespace lk::emulator {

/// Longer than any that carries a message of CAN 2.0: python-can's have about 170 bytes.
inline constexpr std::size_t kLongestCanMsgpack = 512;

/// Nothing: the bytes are no message. Those of CAN FD and error frames keep no data.
std::optional<protocol::Frame> parse_can_msgpack(std::span<const std::uint8_t> bytes);
/// `stamp` is of the wall clock.
std::vector<std::uint8_t> can_msgpack(const protocol::Frame& frame, std::chrono::nanoseconds stamp);

}  // namespace lk::emulator
