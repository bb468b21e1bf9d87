#pragma once

/// @file Error confinement of CAN controllers, and what of it a host sees.

#include "protocol/frame.hpp"

namespace lk::emulator {

// Error counters of a CAN controller (ISO 11898-1, fault confinement).
inline constexpr int kErrorStep = 8;       // for each frame of its own that is destroyed
inline constexpr int kErrorWarning = 96;   // where drivers begin to warn
inline constexpr int kErrorPassive = 128;  // it lets others go first
inline constexpr int kBusOff = 256;        // it leaves the bus

/// A drive at another bit rate hears errors; it answers each with an error flag of its own, eight
/// of its receive counter each, until it is error-passive: so many flags.
inline constexpr int kFlagsToPassive = kErrorPassive / kErrorStep;

/// The controller of the hosts' adapter.
struct HostLink {
  int transmit_errors = 0;
  int receive_errors = 0;
};

/// What a host's adapter reports of a destroyed frame, as SocketCAN has it (linux/can/error.h): a
/// bus error, its own counters, and the states that these reach. `sending`: the frame was a host's.
/// The state of a drive's controller is nowhere on the wire: a host sees its bus errors and then
/// its silence.
protocol::Frame report_error(HostLink& host, bool sending);
/// What it reports when it has lost what it was to hand over: the queue of its host was full.
protocol::Frame report_overrun();
/// A frame got through.
void count_success(HostLink& host, bool sending);

}  // namespace lk::emulator
