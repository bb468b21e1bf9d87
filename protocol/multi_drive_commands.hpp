#pragma once

/// @file Queries to the drives 1..4 in one frame; array element n is for drive n + 1.

#include <array>
#include <cstdint>

#include "protocol/opcodes.hpp"

namespace lk::protocol {

struct MultiTorque {
  static constexpr std::uint32_t kIdentifier = 0x280;
  std::array<double, kMultiDriveSlots> iq_A{};
  bool operator==(const MultiTorque&) const = default;
};

struct MultiSpeed {
  static constexpr std::uint32_t kIdentifier = 0x281;
  std::array<std::int16_t, kMultiDriveSlots> speed_dps{};
  bool operator==(const MultiSpeed&) const = default;
};

struct MultiPosition {
  static constexpr std::uint32_t kIdentifier = 0x282;
  std::array<std::int16_t, kMultiDriveSlots> target_cdeg{};
  bool operator==(const MultiPosition&) const = default;
};

struct MultiCommand {
  static constexpr std::uint32_t kIdentifier = 0x288;
  std::array<std::uint8_t, kMultiDriveSlots> opcodes{};
  bool operator==(const MultiCommand&) const = default;
};

}  // namespace lk::protocol
