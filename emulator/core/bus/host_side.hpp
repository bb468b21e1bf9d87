#pragma once

#include <cstddef>
#include <cstdint>

#include "emulator/core/bus/can_errors.hpp"
#include "emulator/core/host_queue.hpp"
#include "emulator/core/sim_time.hpp"
#include "protocol/frame.hpp"

namespace lk::emulator {

/// Connection of the hosts to a CAN bus that a fault cuts. The worst one counts.
enum class HostCut : std::uint8_t {
  kNone,
  kCable,  // the hosts' frames are not acknowledged; they receive nothing
  kOff,    // the hosts' controller is bus-off; frames are lost
  kGone,   // the hosts have no adapter; frames are lost
  kMoved,  // as kGone; the adapter returns under another name
};

/// Motion commands that the last replay of the hosts' queue has sent too late.
struct StaleCommands {
  std::uint64_t count = 0;
  SimTime age{0};         // of the oldest
  protocol::Frame frame;  // the first one
};

/// The hosts' side of a CAN bus: controller and connection. The wire has their queue.
struct HostSide {
  QueueFull full;            // as configured
  bool always_acknowledged;  // by another node than the drives
  HostErrorCounters errors = {};
  HostCut cut = HostCut::kNone;
  bool unacknowledged = false;  // the last frame of a host was not acknowledged
  std::size_t to_replay = 0;    // queued frames that waited for an acknowledgement
  StaleCommands stale = {};

  bool is_off() const { return cut >= HostCut::kOff; }
};

}  // namespace lk::emulator
