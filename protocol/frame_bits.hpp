#pragma once

#include <cstdint>

#include "protocol/frame.hpp"

namespace lk::protocol {

/// Bus idle bits that follow every frame before the next may start (ISO 11898-1, intermission).
inline constexpr int kInterframeBits = 3;

/// The number of bits a classical CAN frame occupies from its start of frame to the last bit of its
/// end of frame, the stuff bits that its contents need included. `frame` is kData or kRemote; a
/// DLC above 8 stands for 8 bytes. A frame of the protocol (11-bit identifier, 8 bytes) takes
/// 108..132 bits.
int frame_bits(const Frame& frame);

/// The bits by which CAN decides between frames that start at the same time, as a number: the lower
/// one wins. Identifier first; with equal ones data wins against remote, standard against extended.
std::uint32_t arbitration_field(const Frame& frame);

/// CRC-15 of the bits from start of frame to the end of data, as the frame carries it.
std::uint16_t frame_crc(const Frame& frame);

}  // namespace lk::protocol
