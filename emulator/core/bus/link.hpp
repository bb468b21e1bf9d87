#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "emulator/core/bus/wire.hpp"
#include "emulator/core/sim_time.hpp"

namespace lk::emulator {

/// A frame that a drive is about to send.
struct Outgoing {
  SimTime ready{0};
  protocol::Frame frame;
  std::uint64_t after_rom_write = 0;  // a copy has the number of its original
  bool held_back = false;             // to be sent after the next frame
};

/// Link controller of a drive, between firmware and wire. Copies are independent; the bus owns the
/// wire.
struct DriveLink {
  std::uint32_t owner;                      // 0x140 + configured ID; of a duplicate: see Duplicates
  int errors = 0;                           // transmit error counter
  bool bus_off = false;                     // neither sends nor receives
  bool blocked = false;                     // the send queue is stopped
  SimTime last_reply{0};                    // ready time of the last frame; keeps the order
  std::optional<Outgoing> held_back = {};   // frame to be sent after the next frame
  std::optional<Outgoing> last_frame = {};  // last reply of the firmware, before faults changed it
  std::uint64_t replies_drawn = 0;          // number of random reply times drawn

  /// The drive accepts no query: too many of its replies wait for the flash or for the wire.
  bool full(const Wire& wire) const;
  /// The drive does not receive a query that ends at `end`, because it is replying on RS-485.
  bool is_deaf(const Wire& wire, SimTime end) const {
    return wire.serial() != nullptr && wire.serial()->cannot_receive(owner, end);
  }
  bool cannot_receive(const Wire& wire, SimTime end) const {
    return full(wire) || is_deaf(wire, end);
  }
  /// Queues a frame behind earlier ones. Returns the number of lost frames: 1 if `full`, else 0.
  std::size_t send(Wire& wire, const Outgoing& out);
  /// As `send`, for several frames. A frame with `held_back` is kept and sent after the next frame.
  std::size_t send_all(Wire& wire, const std::vector<Outgoing>& out);
  /// Queues an unsolicited frame, unless two copies of it are pending: one on the wire and one
  /// behind it suffice to keep the wire busy. Returns true if queued.
  bool babble(Wire& wire, const protocol::Frame& frame, SimTime now) const;
  /// Drops all pending frames, including one that is on the wire at `now`. Returns their number.
  std::size_t drop_all(Wire& wire, SimTime now);
  /// Stops the send queue at `now`. Returns the number of stopped frames.
  std::size_t block(Wire& wire, SimTime now);
  void release(Wire& wire, SimTime now);
  /// Sends the frame that was held back. Returns the number of lost frames.
  std::size_t release_held_back(Wire& wire, SimTime now);
};

}  // namespace lk::emulator
