#pragma once

/// @file How a command is told: by the first byte of a frame to one drive, by the identifier of one
/// to several.

#include <array>
#include <cstdint>

namespace lk::protocol {

/// Identifier of a drive's queries is kSingleDriveId + ID, ID 1..32; that of its replies too, as
/// far as real drives go (Dialect::reply_id_base).
inline constexpr std::uint32_t kSingleDriveId = 0x140;
inline constexpr int kMinId = 1;
inline constexpr int kMaxId = 32;
inline constexpr int kMaxDrivesPerBus = kMaxId - kMinId + 1;
/// Where replies come from, less the ID: where real drives reply, where an older manual has it
/// (docs/protocol.md §8), and where MyActuator drives do from V3 on, which are not emulated.
inline constexpr std::array<std::uint32_t, 3> kReplyIdBases{kSingleDriveId, 0x180, 0x240};
/// The drive 1..32 that `base` plus an ID stands for; 0: none.
constexpr int drive_at(std::uint32_t identifier, std::uint32_t base) {
  const std::int64_t id = std::int64_t{identifier} - base;
  return id >= kMinId && id <= kMaxId ? static_cast<int>(id) : 0;
}
/// The drive that replies with this identifier, where that is not the one of its queries; 0: none.
constexpr int drive_at_own(std::uint32_t identifier) {
  return drive_at(identifier, kReplyIdBases[1]) + drive_at(identifier, kReplyIdBases[2]);
}

/// Commands for several drives are for the drives 1..4.
inline constexpr int kMultiDriveSlots = 4;
/// In a slot of a MultiCommand: nothing for this drive.
inline constexpr std::uint8_t kNoCommand = 0x00;

/// DATA[0] of a query to a single drive. The commands have it: Torque::kOpcode.
enum class Opcode : std::uint8_t {};

}  // namespace lk::protocol
