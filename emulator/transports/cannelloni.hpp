#pragma once

/// @file The datagrams of cannelloni, version 2: frames of CAN as they stand in `linux/can.h`, in
/// the byte order of networks (its doc/udp_format.md, and what its parser makes of that).

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "protocol/frame.hpp"

namespace lk::emulator {

/// What cannelloni reads of a datagram, and what it sends in one: an Ethernet frame's worth.
inline constexpr std::size_t kLongestCannelloni = 1500;
inline constexpr std::size_t kMostCannelloniFrames = (1472 - 5) / (5 + protocol::kCanBytes);

struct CannelloniPacket {
  std::uint8_t sequence = 0;
  std::vector<protocol::Frame> frames;
};
/// Nothing: the bytes are no packet. What stands behind its frames is of no account. Frames of CAN
/// FD and error frames keep no data.
std::optional<CannelloniPacket> parse_cannelloni(std::span<const std::uint8_t> bytes);
/// No more frames than kMostCannelloniFrames: kData, kRemote or kError.
std::vector<std::uint8_t> cannelloni_packet(std::span<const protocol::Frame> frames,
                                            std::uint8_t sequence);

/// Packets are numbered, from 0 on and after 255 anew.
class PacketsMissed {
 public:
  /// How many did not come between the last one and this. One that comes late or twice counts for
  /// nothing; neither does 0, which the other end says when it starts.
  unsigned before(std::uint8_t sequence);

 private:
  std::optional<std::uint8_t> last_;
};

}  // namespace lk::emulator
