#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace lk::protocol {

/// Kind of a frame. On CAN, only `kData` frames with a standard identifier carry the protocol. On
/// RS-485, `kSerial` is a packet with correct checksums, and `kBytes` are all other bytes.
enum class FrameKind : std::uint8_t { kData, kRemote, kError, kFd, kSerial, kBytes };

/// Largest identifiers of 11 and of 29 bits.
inline constexpr std::uint32_t kMaxStandardId = 0x7FF;
inline constexpr std::uint32_t kMaxExtendedId = 0x1FFFFFFF;
/// Data bytes of a CAN frame.
inline constexpr std::size_t kCanBytes = 8;
/// Largest LEN of a packet on RS-485 (docs/reference/rs485.md).
inline constexpr std::size_t kMaxLen = 112;
/// Size of a packet with `kMaxLen`: 3E, CMD, ID, LEN, a checksum, the data, another checksum.
inline constexpr std::size_t kMaxBytes = 6 + kMaxLen;

/// Data of a Frame. Bytes from index `dlc` on are 0.
using Payload = std::array<std::uint8_t, kMaxBytes>;

/// One frame on CAN or RS-485.
///
/// CAN: `id` holds 11 bits, or 29 if `extended`. `dlc` is 0..8. Payloads of CAN FD are not kept: LK
/// drives do not use CAN FD, and such frames are only counted.
///
/// RS-485, `kSerial`: `id` is 0x140 + ID, `data[0]` the command, `data[1 + n]` D[n], `dlc` 1 + LEN.
/// A multi-drive packet has the `id` 0x200 + command, as on CAN, and eight bytes of `data`.
/// RS-485, `kBytes`: `dlc` bytes as on the wire, `id` 0.
struct Frame {
  std::uint32_t id = 0;
  FrameKind kind = FrameKind::kData;
  bool extended = false;
  std::uint8_t dlc = kCanBytes;
  Payload data{};

  friend bool operator==(const Frame&, const Frame&) = default;
};

/// Returns true for a frame of RS-485.
constexpr bool is_serial(const Frame& frame) {
  return frame.kind == FrameKind::kSerial || frame.kind == FrameKind::kBytes;
}

}  // namespace lk::protocol
