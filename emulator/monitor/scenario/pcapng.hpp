#pragma once

/// @file Captures for Wireshark: pcapng with frames in SocketCAN format (LINKTYPE 227).
/// https://www.ietf.org/archive/id/draft-ietf-opsawg-pcapng-03.html,
/// https://www.tcpdump.org/linktypes/LINKTYPE_CAN_SOCKETCAN.html

#include <cstddef>
#include <span>
#include <string>

#include "emulator/core/bus_config.hpp"
#include "emulator/core/sim_time.hpp"
#include "protocol/frame.hpp"

namespace lk::emulator {

/// Interface in the file.
struct CapturedBus {
  explicit CapturedBus(const BusConfig& bus);
  std::string name;
  std::string drives;  // "LK-TECH drives: 1 v235 MG, 2 legacy MF", for the dissector
};

/// Returns the start of the file: one interface for each bus, times in nanoseconds.
std::string pcapng_begin(std::span<const CapturedBus> buses);
/// Returns a frame on one bus; hosts' frames are outbound, drives' frames inbound.
std::string pcapng_frame(std::size_t bus, SimTime at, const protocol::Frame& frame, bool from_host);

}  // namespace lk::emulator
