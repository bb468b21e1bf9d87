#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "emulator/sim_time.hpp"
#include "protocol/frame.hpp"

namespace lk::emulator {

/// The medium: one frame at a time, the lowest identifier first (docs/protocol.md, "Time on the
/// wire"). Those who want to send are the hosts, as one adapter with a FIFO queue, and the drives.
class CanWire {
 public:
  /// Frames the hosts' send queue holds. At 1 Mbit/s they are a backlog of about 120 ms.
  static constexpr std::size_t kHostQueue = 1024;

  /// Replies a drive holds ready; assumed: a controller's three mailboxes and a queue in front.
  static constexpr std::size_t kDriveQueue = 16;

  /// A frame that got through.
  struct Delivery {
    SimTime at;  // its last bit
    protocol::Frame frame;
    bool from_host;
    std::uint64_t after_rom_write;  // as given to send_from_drive
  };

  /// `bitrate` in bit/s; 0 = frames take no time and do not wait for each other.
  explicit CanWire(std::int64_t bitrate);

  bool host_queue_full() const { return host_count_ == kHostQueue; }
  std::size_t host_queue_size() const { return host_count_; }
  /// A host's frame waits from `at` on, behind those before it. The queue must not be full; `frame`
  /// is kData or kRemote.
  void send_from_host(SimTime at, const protocol::Frame& frame);
  /// The drive that answers with `reply_id` has so many replies waiting that it takes nothing in.
  bool drive_queue_full(std::uint32_t reply_id) const;
  /// A drive's frame waits from `at` on. `after_rom_write` is handed through. The drive's queue
  /// must not be full.
  void send_from_drive(SimTime at, const protocol::Frame& frame, std::uint64_t after_rom_write = 0);

  /// When the next frame starts if it is a drive's; `next_due` is its end.
  std::optional<SimTime> next_reply_start() const;
  /// The drive that answers with `reply_id` has lost its power, and with it what it wanted to send:
  /// so many frames. One that has begun by `now` is spoiled, and has the wire to its end.
  std::size_t forget_replies(std::uint32_t reply_id, SimTime now);

  /// When the next frame will have got through, if nothing else is sent; none when nothing waits.
  std::optional<SimTime> next_due() const;
  /// The next frame, if its last bit is on the wire by `until`; it no longer waits then. Nothing is
  /// decided before: a frame sent later but in time for the arbitration still takes part.
  std::optional<Delivery> deliver(SimTime until);

  /// How long the wire was occupied so far, inter-frame spaces included.
  SimTime busy() const { return busy_; }

 private:
  struct Waiting {
    SimTime at{0};
    protocol::Frame frame;
    std::uint64_t after_rom_write = 0;
    std::uint32_t priority = 0;  // arbitration field, the lower wins
    SimTime length{0};           // up to the last bit
    SimTime occupancy{0};        // and the inter-frame space
  };
  /// Who sends next, and from when.
  struct Turn {
    SimTime start;
    std::optional<std::size_t> drive;  // index in drives_; none = the head of the hosts' queue
  };

  Waiting waiting(SimTime at, const protocol::Frame& frame) const;
  std::optional<Turn> next_turn() const;
  const Waiting& sender(const Turn& turn) const;
  void remove(const Turn& turn);

  std::int64_t bitrate_;
  SimTime free_at_{0};
  SimTime busy_{0};
  std::vector<Waiting> hosts_;  // a ring
  std::size_t host_head_ = 0;
  std::size_t host_count_ = 0;
  std::vector<Waiting> drives_;  // in the order in which they were sent
};

}  // namespace lk::emulator
