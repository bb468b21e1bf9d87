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
  kErrorFrame,      // reported by the controller, not sent by anybody
  kCanFd,           // CAN FD frame
  kRemote,          // remote transmission request
  kExtended,        // 29-bit identifier
  kForeignId,       // no drive's, nor one for several drives that a drive here knows
  kNoSuchDrive,     // a drive's identifier, but no such drive on this bus
  kWrongLength,     // DLC is not 8; LEN is not the command's
  kUnknownCommand,  // the drive does not know DATA[0], or the parameter in DATA[1]
  kWrongMode,  // single-drive frame to a drive in multi-drive mode, or 0x280 with no drive in it
  kNoPower,    // the drive is without power, or still booting
  kDriveBusy,  // too many of the drive's replies wait already, for its flash or for the wire
  kFault,      // an injected fault kept it from the drive
  kQueueFull,  // the host sends faster than the wire carries, and its send queue ran over
  kNoPacket,   // bytes on RS-485 that are no packet, or that became none on the wire
};
inline constexpr std::size_t kDropKinds = 14;

/// A short name for logs and summaries: "unknown command".
std::string_view to_string(Drop cause);

/// Counters of one drive since the bus was made; a power cycle does not reset them.
struct ServoStats {
  std::uint64_t queries = 0;           // frames the drive accepted
  std::uint64_t replies = 0;           // replies it gave, one for each query
  std::uint64_t unknown_commands = 0;  // no reply
  std::uint64_t wrong_mode = 0;        // single-drive frames ignored in multi-drive mode
  std::uint64_t refused_motion = 0;    // answered, not executed: the drive is off or has an error
  std::uint64_t invalid_targets = 0;   // answered, not executed: 0xA5/0xA6 target, 0x8C action
  std::uint64_t rom_writes = 0;        // each wears a real drive's memory; and injected damage

  friend bool operator==(const ServoStats&, const ServoStats&) = default;
};

/// Counters of one bus since it was made.
struct BusStats {
  std::uint64_t frames = 0;   // put on the bus by hosts, whatever they are
  std::uint64_t queries = 0;  // accepted by at least one drive
  // What drives say: the sum of the drives' replies + extra_frames = replies + replies_lost +
  // replies_waiting.
  std::uint64_t replies = 0;           // frames of drives that have reached the hosts
  std::uint64_t replies_lost = 0;      // never will: by a fault or with the power; of these,
  std::uint64_t replies_collided = 0;  // in a collision on RS-485
  std::uint64_t replies_overrun = 0;   // as the hosts' adapter was full
  std::uint64_t replies_waiting = 0;   // are in the drives still, or in the hosts' adapter
  std::uint64_t extra_frames = 0;      // no query's reply: copies, babble, a second drive's
  std::uint64_t error_frames = 0;      // that hosts saw: of destroyed frames, and of overruns
  // What hosts say: frames = queries + dropped + frames_waiting.
  std::array<std::uint64_t, kDropKinds> dropped{};  // by Drop
  std::uint64_t frames_waiting = 0;                 // in the hosts' send queue still
  std::uint64_t refused_motion = 0;                 // sums over the drives
  std::uint64_t invalid_targets = 0;
  std::uint64_t rom_writes = 0;
  std::uint64_t queue_peak = 0;      // most host frames waiting at once
  protocol::ReceiverStats receiver;  // what the drives' receivers dropped, on RS-485
  SimTime wire_busy{0};              // time the wire was occupied, inter-frame spaces included

  void drop(Drop cause) { ++dropped[static_cast<std::size_t>(cause)]; }
  std::uint64_t count(Drop cause) const { return dropped[static_cast<std::size_t>(cause)]; }
  friend bool operator==(const BusStats&, const BusStats&) = default;
};

}  // namespace lk::emulator
