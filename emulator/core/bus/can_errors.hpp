#pragma once

/// @file Error confinement of CAN controllers, and the error frames for hosts.

#include <optional>

#include "protocol/frame.hpp"

namespace lk::emulator {

// Error counters of a CAN controller (ISO 11898-1, fault confinement).
inline constexpr int kErrorStep = 8;       // per destroyed frame that the controller sent
inline constexpr int kErrorWarning = 96;   // host drivers report a warning from here on
inline constexpr int kErrorPassive = 128;  // the controller lets other nodes send first
inline constexpr int kBusOff = 256;        // the controller leaves the bus

/// Number of error flags that a drive at another bit rate sends until it is error-passive. Each
/// flag adds eight to the drive's receive error counter.
inline constexpr int kFlagsToPassive = kErrorPassive / kErrorStep;

/// Error counters of the CAN controller in the hosts' adapter.
struct HostErrorCounters {
  int transmit_errors = 0;
  int receive_errors = 0;
};

/// Returns the error frame of the hosts' adapter for a destroyed frame, as SocketCAN defines it
/// (linux/can/error.h): bus error, counters, and error states. `sending`: a host sent the frame.
/// The frame cannot show a drive's error state: of a failing drive, hosts see bus errors, then
/// silence.
protocol::Frame report_error(HostErrorCounters& host, bool sending);
/// Counts a frame of a host that no node acknowledged. The counter stops at error-passive: such
/// errors of a passive controller do not count (ISO 11898-1, fault confinement). Returns the error
/// frame for the first of these errors and for a new error state, else nullopt.
std::optional<protocol::Frame> report_no_ack(HostErrorCounters& host, bool first);
/// Returns the error frame for bus-off, or for the restart after it.
protocol::Frame report_bus_off(bool restarted);
/// Returns the error frame for an overflow of the host's receive queue.
protocol::Frame report_overrun();
/// Updates the counters after a frame without error. `sending`: a host sent the frame.
void count_success(HostErrorCounters& host, bool sending);

}  // namespace lk::emulator
