#pragma once

/// @file How a command is told: by the first byte of a frame to one drive, by the identifier of one
/// to several.

#include <cstdint>

namespace lk::protocol {

/// Identifier of a drive's queries is kSingleDriveId + ID, ID 1..32; that of its replies too, as
/// far as real drives go (Dialect::reply_id_base).
inline constexpr std::uint32_t kSingleDriveId = 0x140;
inline constexpr int kMinId = 1;
inline constexpr int kMaxId = 32;
inline constexpr int kMaxDrivesPerBus = kMaxId - kMinId + 1;
/// Commands for several drives are for the drives 1..4.
inline constexpr int kMultiDriveSlots = 4;
/// In a slot of a MultiCommand: nothing for this drive.
inline constexpr std::uint8_t kNoCommand = 0x00;

/// DATA[0] of a query to a single drive. The commands have it: Torque::kOpcode.
enum class Opcode : std::uint8_t {};

}  // namespace lk::protocol
