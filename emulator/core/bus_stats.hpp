#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "emulator/core/sim_time.hpp"
#include "protocol/serial_framing.hpp"

namespace lk::emulator {

/// Why a frame got no reply.
enum class Drop : std::uint8_t {
  kErrorFrame,      // reported by a controller, sent by no node
  kCanFd,           // CAN FD frame
  kRemote,          // remote transmission request
  kExtended,        // 29-bit identifier
  kForeignId,       // neither a drive's identifier nor a multi-drive one that a drive here knows
  kNoSuchDrive,     // identifier of a drive that is not on this bus
  kWrongLength,     // DLC is not 8; LEN does not match the command
  kUnknownCommand,  // unknown DATA[0], or unknown parameter in DATA[1]
  kWrongMode,  // single-drive frame to a drive in multi-drive mode; 0x280, no drive in that mode
  kNoPower,    // the drive is unpowered or booting
  kDriveBusy,  // too many pending replies, or deaf: replying on RS-485, or calibrating
  kFault,      // an injected fault kept the frame from the drive
  kQueueFull,  // the host sends faster than the wire carries; its send queue is full
  kNoPacket,   // bytes on RS-485 that are not a packet, or that the wire spoiled
};
inline constexpr std::size_t kDropKinds = 14;

/// A short name for logs and summaries: "unknown command".
std::string_view to_string(Drop cause);

/// Counters of one drive since construction of the bus; a power cycle does not reset them.
struct ServoStats {
  std::uint64_t queries = 0;           // frames that the drive accepted
  std::uint64_t replies = 0;           // one for each query
  std::uint64_t unknown_commands = 0;  // no reply
  std::uint64_t wrong_mode = 0;        // single-drive frames ignored in multi-drive mode
  std::uint64_t refused_motion = 0;    // acknowledged, not executed: off, error or calibration
  std::uint64_t invalid_targets = 0;   // acknowledged, not executed: 0xA5/0xA6 target, 0x8C action
  std::uint64_t rom_writes = 0;  // each wears the memory of a real drive; includes injected damage

  friend bool operator==(const ServoStats&, const ServoStats&) = default;
};

/// Counters of one bus since its construction.
struct BusStats {
  std::uint64_t frames = 0;   // sent by hosts, valid or not
  std::uint64_t queries = 0;  // accepted by at least one drive
  // Frames of drives. Invariant: sum of ServoStats::replies + extra_frames = replies + replies_lost
  // + replies_waiting.
  std::uint64_t replies = 0;           // received by hosts
  std::uint64_t replies_lost = 0;      // by a fault or a power loss; of these:
  std::uint64_t replies_collided = 0;  // in a collision on RS-485
  std::uint64_t replies_overrun = 0;   // because the adapter of the hosts was full
  std::uint64_t replies_waiting = 0;   // in the drives or in the hosts' adapter
  std::uint64_t extra_frames = 0;      // replies to no query: copies, babble, echoes, duplicates
  std::uint64_t error_frames = 0;      // seen by hosts: destroyed frames, and overruns
  // Frames of hosts. Invariant: frames = queries + dropped + frames_waiting.
  std::array<std::uint64_t, kDropKinds> dropped{};  // indexed by Drop
  std::uint64_t frames_waiting = 0;                 // in the send queue of the hosts
  std::uint64_t refused_motion = 0;                 // sums over the drives
  std::uint64_t invalid_targets = 0;
  std::uint64_t rom_writes = 0;
  std::uint64_t queue_peak = 0;      // most host frames waiting at once
  protocol::ReceiverStats receiver;  // drops in the receivers of drives, RS-485 only
  SimTime wire_busy{0};              // time the wire was occupied, inter-frame spaces included

  void drop(Drop cause) { ++dropped[static_cast<std::size_t>(cause)]; }
  std::uint64_t count(Drop cause) const { return dropped[static_cast<std::size_t>(cause)]; }
  friend bool operator==(const BusStats&, const BusStats&) = default;
};

}  // namespace lk::emulator
