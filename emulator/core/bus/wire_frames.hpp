#pragma once

#include <cstdint>

#include "emulator/core/sim_time.hpp"
#include "protocol/frame.hpp"

namespace lk::emulator {

/// A frame that was transmitted intact, or bytes that were spoiled on RS-485.
struct WireDelivery {
  SimTime at{0};  // end of its last bit
  protocol::Frame frame;
  bool from_host = false;
  std::uint64_t after_rom_write = 0;  // as given to send_from_drive
  std::uint32_t owner = 0;            // as given to send_from_drive; of a host: `sender`
  bool from_pieces = false;           // of a host: a packet that ends before the host's frame
  bool met_host = false;              // of a drive: a byte began while hosts held the line
  SimTime queued_at{0};               // of a host on CAN: when it entered the queue
};

/// A frame whose last bit is due, but which may still be destroyed.
struct WireCandidate {
  protocol::Frame frame;
  bool from_host;
  std::uint32_t owner;
};

}  // namespace lk::emulator
