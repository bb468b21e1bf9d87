#pragma once

#include <array>
#include <cstdint>

namespace lk::protocol {

/// What a CAN controller hands over. Only `kData` frames with a standard identifier carry the
/// protocol.
enum class FrameKind : std::uint8_t { kData, kRemote, kError, kFd };

/// One CAN frame as a value. `id` holds 11 bits, or 29 when `extended`. `dlc` is 0..8 (CAN FD
/// payloads are not kept: no LK drive speaks CAN FD, such frames are only counted).
struct Frame {
  std::uint32_t id = 0;
  FrameKind kind = FrameKind::kData;
  bool extended = false;
  std::uint8_t dlc = 8;
  std::array<std::uint8_t, 8> data{};

  friend bool operator==(const Frame&, const Frame&) = default;
};

}  // namespace lk::protocol
