#pragma once

#include <cstdint>

#include "protocol/frame.hpp"

namespace lk::protocol {

/// Idle bits between two frames (ISO 11898-1, intermission).
inline constexpr int kInterframeBits = 3;

/// Returns the bits of a classical CAN frame from start of frame to end of frame, with stuff bits.
/// Pre: `frame` is kData or kRemote. A DLC above 8 counts as 8 bytes. A frame of the protocol
/// (11-bit identifier, 8 bytes) takes 108..132 bits.
int frame_bits(const Frame& frame);

/// Returns the arbitration bits as a number: of two frames that start together, the one with the
/// lower number wins. With equal identifiers, data wins over remote, and standard over extended.
std::uint32_t arbitration_field(const Frame& frame);

/// Returns the CRC-15 of the bits from start of frame to the end of data, as sent in the frame.
std::uint16_t frame_crc(const Frame& frame);

}  // namespace lk::protocol
