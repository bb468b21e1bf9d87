#pragma once

/// @file Error confinement of CAN controllers, and the error frames for hosts.

#include "protocol/frame.hpp"

namespace lk::emulator {

// Error counters of a CAN controller (ISO 11898-1, fault confinement).
inline constexpr int kErrorStep = 8;       // for each destroyed frame of its own
inline constexpr int kErrorWarning = 96;   // drivers warn from here on
inline constexpr int kErrorPassive = 128;  // it lets other nodes send first
inline constexpr int kBusOff = 256;        // it leaves the bus

/// Error flags that a drive at another bit rate sends until it is error-passive. Each one adds
/// eight to its receive error counter.
inline constexpr int kFlagsToPassive = kErrorPassive / kErrorStep;

/// CAN controller of the hosts' adapter.
struct HostErrorCounters {
  int transmit_errors = 0;
  int receive_errors = 0;
};

/// Returns the error frame of the hosts' adapter for a destroyed frame, as SocketCAN defines it
/// (linux/can/error.h): bus error, counters, and their states. `sending`: the frame was a host's. A
/// drive's controller state is not on the wire: a host sees bus errors, then silence.
protocol::Frame report_error(HostErrorCounters& host, bool sending);
/// Returns the error frame for an overflow of the host's receive queue.
protocol::Frame report_overrun();
/// Updates the counters for a frame that got through.
void count_success(HostErrorCounters& host, bool sending);

}  // namespace lk::emulator
