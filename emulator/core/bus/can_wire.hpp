#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "emulator/core/bus/wire_frames.hpp"
#include "emulator/core/sim_time.hpp"
#include "protocol/frame.hpp"

namespace lk::emulator {

/// CAN medium: one frame at a time, the lowest identifier first (docs/reference/protocol.md, "Time
/// on the wire"). Senders are the drives, and the hosts as one adapter with a FIFO queue.
class CanWire {
 public:
  /// Capacity of the hosts' send queue, frames: about 120 ms at 1 Mbit/s.
  static constexpr std::size_t kHostQueue = 1024;

  /// Capacity of a drive's send queue; assumed: three mailboxes of a controller, and a queue.
  static constexpr std::size_t kDriveQueue = 16;

  /// After a destroyed frame. The bit error is assumed in the CRC. The receivers' error flags begin
  /// after the ACK delimiter (ISO 11898-1), in place of the 7-bit end of frame. The sender's flag
  /// follows one bit later; together they take 7 bits. So the flags end where the frame would have
  /// ended. Delimiter and intermission follow.
  static constexpr int kErrorDelimiterBits = 8;
  /// Extra wait of an error-passive sender (ISO 11898-1, suspend transmission).
  static constexpr int kSuspendBits = 8;
  /// Bits that a controller counts before it recovers from bus-off (ISO 11898-1).
  static constexpr int kRecoveryBits = 128 * 11;

  /// `bitrate` in bit/s; 0: frames take no time and do not wait.
  explicit CanWire(std::int64_t bitrate);

  std::int64_t bitrate() const { return bitrate_; }
  bool host_queue_full() const { return host_count_ == kHostQueue; }
  std::size_t host_queue_size() const { return host_count_; }
  /// Host frames that are ready for the wire at `now`; others are in an adapter.
  std::size_t host_frames_ready(SimTime now) const;
  /// Queues a host's frame, ready at `at`. Pre: the queue is not full; `frame` is kData or kRemote.
  /// `sender` becomes the owner in the delivery.
  void send_from_host(SimTime at, const protocol::Frame& frame, std::uint32_t sender = 0);
  // `owner` identifies a drive: the identifier of its replies, even if a frame has another one.

  /// The drive has kDriveQueue frames pending, `elsewhere` included, and accepts no query.
  bool drive_queue_full(std::uint32_t owner, std::size_t elsewhere = 0) const;
  /// Pending frames of all drives.
  std::size_t drive_frames() const { return drives_.size(); }
  /// Copies of this frame of the drive that are pending or on the wire.
  std::size_t copies(std::uint32_t owner, const protocol::Frame& frame) const;
  /// Queues a drive's frame, ready at `at`. Pre: its queue is not full. `after_rom_write` is passed
  /// on to the delivery.
  void send_from_drive(SimTime at, const protocol::Frame& frame,
                       std::uint64_t after_rom_write = 0) {
    send_from_drive(at, frame, after_rom_write, frame.id, false);
  }
  /// Queues a frame with a given owner; a blocked one does not arbitrate until it is released.
  void send_from_drive(SimTime at, const protocol::Frame& frame, std::uint64_t after_rom_write,
                       std::uint32_t owner, bool blocked);
  /// Blocks the drive's pending frames, except one that began before `now`. Returns their number.
  std::size_t block(std::uint32_t owner, SimTime now);
  void release(std::uint32_t owner, SimTime now);

  /// Start of the next frame if it is a drive's; its end is `next_due`.
  std::optional<SimTime> next_reply_start() const {
    return next_ && next_->drive ? std::optional(next_->start) : std::nullopt;
  }
  /// More than one frame is pending or on the wire.
  bool several_wait() const { return host_count_ + drives_.size() > 1; }
  /// Drops the frames of a drive that lost its power. Returns their number. A frame that began by
  /// `now` is void, but occupies the wire to its end.
  std::size_t drop_replies(std::uint32_t owner, SimTime now);

  /// End of the next frame, if no other is sent; nullopt if none is pending.
  std::optional<SimTime> next_due() const {
    return next_ ? std::optional(next_->end) : std::nullopt;
  }
  /// Removes and returns the next frame if its last bit is on the wire by `until`. The winner is
  /// not fixed earlier: a frame that is sent in time for the arbitration takes part.
  std::optional<WireDelivery> deliver(SimTime until);
  /// Pre: a frame is pending. The frame that `deliver` would return.
  WireCandidate next() const;
  /// Instead of `deliver`: a bit error destroys the frame. Its sender retries, at the earliest
  /// `pause_bits` after the error frame.
  void destroy(int pause_bits);
  /// As `destroy`, but the sender gives up. The next frame of hosts waits `pause_bits`.
  void destroy_for_good(int pause_bits);

  /// Time for which the wire was occupied so far, inter-frame spaces included.
  SimTime busy() const { return busy_; }

 private:
  /// A frame without room for RS-485 packets, because a copy of a bus copies its full queue.
  struct CanFrame {
    CanFrame() = default;
    explicit CanFrame(const protocol::Frame& frame);
    explicit operator protocol::Frame() const;
    friend bool operator==(const CanFrame&, const CanFrame&) = default;

    std::uint32_t id = 0;
    protocol::FrameKind kind = protocol::FrameKind::kData;
    bool extended = false;
    std::uint8_t dlc = 0;
    std::array<std::uint8_t, protocol::kCanBytes> data{};
  };
  struct Waiting {
    SimTime at{0};
    CanFrame frame;
    std::uint64_t after_rom_write = 0;
    std::uint32_t owner = 0;
    bool blocked = false;
    std::uint32_t priority = 0;  // arbitration field; the lowest wins
    SimTime length{0};           // up to the last bit
    SimTime occupancy{0};        // plus the inter-frame space
  };
  /// Next sender, with start and end of its frame.
  struct Transmission {
    SimTime start;
    SimTime end;
    std::optional<std::size_t> drive;  // index in drives_; none: the head of the hosts' queue
  };

  Waiting waiting(SimTime at, const protocol::Frame& frame) const;
  std::optional<Transmission> next_transmission() const;
  /// Call after each change of the pending frames.
  void update_next() { next_ = next_transmission(); }
  const Waiting& sender(const Transmission& transmission) const;
  void remove(const Transmission& transmission);
  void break_off(const Transmission& transmission);
  SimTime host_ready() const { return std::max(hosts_[host_head_].at, hosts_from_); }

  std::int64_t bitrate_;
  SimTime free_at_{0};
  SimTime hosts_from_{0};  // their adapter is off the bus until then
  SimTime busy_{0};
  std::vector<Waiting> hosts_;  // ring buffer
  std::size_t host_head_ = 0;
  std::size_t host_count_ = 0;
  std::vector<Waiting> drives_;       // in the order of sending
  std::optional<Transmission> next_;  // cached; read more often than it changes
};

}  // namespace lk::emulator
