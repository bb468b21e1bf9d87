#pragma once

#include <cstdint>

#include "emulator/core/sim_time.hpp"
#include "protocol/frame.hpp"

namespace lk::emulator {

/// A frame that got through.
struct WireDelivery {
  SimTime at{0};  // its last bit
  protocol::Frame frame;
  bool from_host = false;
  std::uint64_t after_rom_write = 0;  // as given to send_from_drive
  std::uint32_t owner = 0;            // the same; of a host: its `sender`
  bool from_pieces = false;           // of a host: a packet that no frame of its own was
  bool met_host = false;              // of a drive: hosts kept the line when it began
};

/// A frame whose last bit is due, before it is known whether it gets through.
struct WireCandidate {
  protocol::Frame frame;
  bool from_host;
  std::uint32_t owner;
};

}  // namespace lk::emulator
