#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "emulator/core/sim_time.hpp"
#include "emulator/core/wire/wire.hpp"

namespace lk::emulator {

/// A frame on its way out of a drive.
struct Outgoing {
  SimTime ready{0};
  protocol::Frame frame;
  std::uint64_t after_rom_write = 0;  // a copy acknowledges what its original does
  bool held_back = false;             // until the next one has left
};

/// The controller of a drive, between firmware and wire. A value; the wire is the bus's.
struct DriveLink {
  std::uint32_t owner;                     // of its frames on the wire: 0x140 + the configured ID
  int errors = 0;                          // transmit error counter
  bool bus_off = false;                    // neither sends nor hears
  bool blocked = false;                    // nothing leaves its queue
  SimTime last_reply{0};                   // a drive answers in order
  std::optional<Outgoing> held_back = {};  // it leaves behind the next one
  std::optional<Outgoing> last_said = {};  // what stands in its buffer
  std::uint64_t replies_drawn = 0;         // times of replies

  /// It does not take in another query: what waits for its flash or the wire has to go first.
  bool full(const Wire& wire) const { return wire.drive_queue_full(owner, held_back ? 1 : 0); }
  /// It does not hear a query that ends at `end`: the same, or on RS-485 because of its own reply.
  bool deaf(const Wire& wire, SimTime end) const { return full(wire) || wire.is_deaf(owner, end); }
  /// In the order of calls, whatever waits how long. Returns how many frames are lost: 1 when it is
  /// full.
  std::size_t send(Wire& wire, const Outgoing& out);
  /// The same of several, of which one may be held back.
  std::size_t send_all(Wire& wire, const std::vector<Outgoing>& out);
  /// Sends a frame that nobody asked for. One may wait behind the one on the wire: so it has the
  /// wire to itself when it is fast enough. Returns false when there is no room for another.
  bool babble(Wire& wire, const protocol::Frame& frame, SimTime now) const;
  /// Everything that has not left by `now` is gone. Returns how many frames.
  std::size_t forget(Wire& wire, SimTime now);
  /// Nothing leaves the queue from `now` on. Returns how many frames this catches.
  std::size_t block(Wire& wire, SimTime now);
  void release(Wire& wire, SimTime now);
  /// What was held back leaves. Returns how many frames are lost.
  std::size_t let_go(Wire& wire, SimTime now);
};

}  // namespace lk::emulator
