#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "emulator/core/sim_time.hpp"
#include "protocol/codec.hpp"
#include "protocol/serial_framing.hpp"

namespace lk::emulator {

using protocol::Reject;
using Drop = Reject;

/// Counters of one drive since construction of the bus; a power cycle does not reset them.
struct ServoStats {
  std::uint64_t queries = 0;           // frames that the drive accepted
  std::uint64_t replies = 0;           // made for these queries; some commands have no reply
  std::uint64_t unknown_commands = 0;  // no reply
  std::uint64_t wrong_mode = 0;        // single-drive frames ignored in multi-drive mode
  std::uint64_t refused_motion = 0;    // acknowledged, not executed: off, error or calibration
  std::uint64_t invalid_targets = 0;   // acknowledged, not executed: 0xA5/0xA6 target, 0x8C action
  std::uint64_t rom_writes = 0;  // includes injected damage; each would wear a real drive's memory

  friend bool operator==(const ServoStats&, const ServoStats&) = default;
};

/// Counters of one bus since its construction.
struct BusStats {
  std::uint64_t frames = 0;   // sent by hosts, valid or not
  std::uint64_t queries = 0;  // accepted by at least one drive
  // Frames of drives. Invariant: sum of ServoStats::replies + extra_frames = replies + replies_lost
  // + replies_waiting.
  std::uint64_t replies = 0;           // received by hosts
  std::uint64_t replies_lost = 0;      // by any cause, including the next two
  std::uint64_t replies_collided = 0;  // lost in a collision on RS-485
  std::uint64_t replies_overrun = 0;   // lost because the adapter of the hosts was full
  std::uint64_t replies_waiting = 0;   // pending in the drives or in the hosts' adapter
  std::uint64_t extra_frames = 0;      // replies to no query: copies, babble, echoes, duplicates
  std::uint64_t error_frames = 0;      // received by hosts: for destroyed frames and for overruns
  // Frames of hosts. Invariant: frames = queries + dropped + frames_waiting.
  std::array<std::uint64_t, protocol::kRejects> dropped{};  // indexed by Reject
  std::uint64_t frames_waiting = 0;                         // in the send queue of the hosts
  std::uint64_t refused_motion = 0;                         // these three: sums over the drives
  std::uint64_t invalid_targets = 0;
  std::uint64_t rom_writes = 0;
  std::uint64_t queue_peak = 0;      // most host frames waiting at once
  std::uint64_t unacknowledged = 0;  // times that no node began to acknowledge the hosts' frames
  std::uint64_t replayed = 0;        // frames of hosts that waited for an acknowledgement
  std::uint64_t stale = 0;           // of these: older than 100 ms when they were sent
  protocol::ReceiverStats receiver;  // drops in the receivers of drives, RS-485 only
  SimTime wire_busy{0};              // time the wire was occupied, inter-frame spaces included

  void drop(Reject cause) { ++dropped[static_cast<std::size_t>(cause)]; }
  std::uint64_t count(Reject cause) const { return dropped[static_cast<std::size_t>(cause)]; }
  friend bool operator==(const BusStats&, const BusStats&) = default;
};

}  // namespace lk::emulator
