#pragma once

/// @file Captures for Wireshark: pcapng with CAN frames in SocketCAN format (LINKTYPE 227), and
/// with the bytes of RS-485 packets (LINKTYPE_USER0, 147).
/// https://www.ietf.org/archive/id/draft-ietf-opsawg-pcapng-03.html,
/// https://www.tcpdump.org/linktypes/LINKTYPE_CAN_SOCKETCAN.html

#include <cstddef>
#include <span>
#include <string>

#include "emulator/core/bus_config.hpp"
#include "emulator/core/sim_time.hpp"
#include "protocol/frame.hpp"

namespace lk::emulator {

/// A bus, which is an interface in the capture file.
struct CapturedBus {
  explicit CapturedBus(const BusConfig& bus);
  std::string name;
  std::string drives;  // "LK-TECH drives: 1 v235 MG, 2 legacy MF", for the dissector
};

/// Returns the start of the file: one interface for each bus, times in nanoseconds.
std::string pcapng_begin(std::span<const CapturedBus> buses);
/// Returns the packet block of a frame. `bus`: index of its interface. Hosts' frames are marked as
/// outbound, drives' frames as inbound.
std::string pcapng_frame(std::size_t bus, SimTime at, const protocol::Frame& frame, bool from_host);

}  // namespace lk::emulator
