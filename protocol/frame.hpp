#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace lk::protocol {

/// What a CAN controller hands over: only `kData` frames with a standard identifier carry the
/// protocol. And what goes over RS-485: `kSerial` is a packet whose sums are right, `kBytes` are
/// bytes that are none.
enum class FrameKind : std::uint8_t { kData, kRemote, kError, kFd, kSerial, kBytes };

/// Of identifiers of 11 and of 29 bits.
inline constexpr std::uint32_t kMostStandardId = 0x7FF;
inline constexpr std::uint32_t kMostExtendedId = 0x1FFFFFFF;
/// Data bytes of a CAN frame.
inline constexpr std::size_t kCanBytes = 8;
/// The largest LEN of a packet on RS-485 (docs/rs485.md).
inline constexpr std::size_t kMostLen = 112;
/// And all of that packet: 3E, CMD, ID, LEN, a sum, the data, another sum.
inline constexpr std::size_t kMostBytes = 6 + kMostLen;

/// What is behind `dlc` is 0.
using Payload = std::array<std::uint8_t, kMostBytes>;

/// One frame of either wire as a value.
///
/// CAN: `id` holds 11 bits, or 29 when `extended`. `dlc` is 0..8 (CAN FD payloads are not kept: no
/// LK drive speaks CAN FD, such frames are only counted).
///
/// RS-485, `kSerial`: `id` is 0x140 + ID, `data[0]` the command, `data[1 + n]` D[n], `dlc` 1 + LEN.
/// Of a packet to several drives `id` is 0x200 + its command, as on CAN, and `data` its eight
/// bytes. `kBytes`: `dlc` bytes as they are on the wire, `id` 0.
struct Frame {
  std::uint32_t id = 0;
  FrameKind kind = FrameKind::kData;
  bool extended = false;
  std::uint8_t dlc = kCanBytes;
  Payload data{};

  friend bool operator==(const Frame&, const Frame&) = default;
};

/// It is of RS-485.
constexpr bool is_serial(const Frame& frame) {
  return frame.kind == FrameKind::kSerial || frame.kind == FrameKind::kBytes;
}

}  // namespace lk::protocol
