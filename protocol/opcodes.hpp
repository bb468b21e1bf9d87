#pragma once

/// @file Codes of commands: the first byte of a frame to one drive, or the identifier of a frame to
/// several.

#include <array>
#include <cstdint>

namespace lk::protocol {

/// A query to one drive has the identifier kSingleDriveId + ID, with an ID of 1..32. Real drives
/// reply with the same identifier (see Dialect::reply_id_base).
inline constexpr std::uint32_t kSingleDriveId = 0x140;
inline constexpr int kMinId = 1;
inline constexpr int kMaxId = 32;
inline constexpr int kMaxDrivesPerBus = kMaxId - kMinId + 1;
/// Identifiers of replies minus the ID. In order: real drives; an older manual
/// (docs/reference/protocol.md §8); MyActuator drives from V3 on, which are not emulated.
inline constexpr std::array<std::uint32_t, 3> kReplyIdBases{kSingleDriveId, 0x180, 0x240};
/// Returns the drive 1..32 whose ID plus `base` is `identifier`; 0 if none.
constexpr int drive_at(std::uint32_t identifier, std::uint32_t base) {
  const std::int64_t id = std::int64_t{identifier} - base;
  return id >= kMinId && id <= kMaxId ? static_cast<int>(id) : 0;
}
/// Returns the drive whose replies have this identifier while its queries have another; 0 if none.
constexpr int drive_at_own(std::uint32_t identifier) {
  return drive_at(identifier, kReplyIdBases[1]) + drive_at(identifier, kReplyIdBases[2]);
}

/// Multi-drive commands address the drives 1..4.
inline constexpr int kMultiDriveSlots = 4;
/// Value of a MultiCommand's slot that has no command for its drive.
inline constexpr std::uint8_t kNoCommand = 0x00;

/// DATA[0] of a query to a single drive. Each command defines it, e.g. Torque::kOpcode.
enum class Opcode : std::uint8_t {};

/// Base of queries that consist of DATA[0] only.
template <std::uint8_t kByte>
struct NoFields {
  static constexpr Opcode kOpcode{kByte};
  bool operator==(const NoFields&) const = default;
};

}  // namespace lk::protocol
