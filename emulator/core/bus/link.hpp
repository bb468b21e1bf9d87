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

/// Link controller of a drive, between firmware and wire. A value; the bus owns the wire.
struct DriveLink {
  std::uint32_t owner;                      // of its frames on the wire: 0x140 + the configured ID
  int errors = 0;                           // transmit error counter
  bool bus_off = false;                     // neither sends nor receives
  bool blocked = false;                     // its send queue is stopped
  SimTime last_reply{0};                    // replies stay in order
  std::optional<Outgoing> held_back = {};   // is sent after the next frame
  std::optional<Outgoing> last_frame = {};  // content of its send buffer
  std::uint64_t replies_drawn = 0;          // number of random reply times drawn

  /// It accepts no query: too many replies are pending, for flash or wire.
  bool full(const Wire& wire) const;
  /// It does not receive a query that ends at `end`: it replies on RS-485.
  bool is_deaf(const Wire& wire, SimTime end) const {
    return wire.serial() != nullptr && wire.serial()->cannot_receive(owner, end);
  }
  bool cannot_receive(const Wire& wire, SimTime end) const {
    return full(wire) || is_deaf(wire, end);
  }
  /// Queues a frame in the order of calls. Returns the number of lost frames: 1 if full.
  std::size_t send(Wire& wire, const Outgoing& out);
  /// As `send`, for several frames of which one may be held back.
  std::size_t send_all(Wire& wire, const std::vector<Outgoing>& out);
  /// Sends an unsolicited frame. Queues at most one behind that on the wire, which suffices to
  /// occupy the wire. Returns false if there is no room.
  bool babble(Wire& wire, const protocol::Frame& frame, SimTime now) const;
  /// Drops all frames that have not left by `now`. Returns their number.
  std::size_t drop_all(Wire& wire, SimTime now);
  /// Stops the send queue at `now`. Returns the number of stopped frames.
  std::size_t block(Wire& wire, SimTime now);
  void release(Wire& wire, SimTime now);
  /// Sends the frame that was held back. Returns the number of lost frames.
  std::size_t release_held_back(Wire& wire, SimTime now);
};

}  // namespace lk::emulator
