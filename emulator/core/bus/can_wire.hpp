#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "emulator/core/bus/wire_frames.hpp"
#include "emulator/core/host_queue.hpp"
#include "emulator/core/sim_time.hpp"
#include "protocol/frame.hpp"

namespace lk::emulator {

/// CAN medium: one frame at a time, the lowest identifier first (docs/reference/protocol.md, "Time
/// on the wire"). Senders are the drives, and the hosts as one adapter with a FIFO queue.
class CanWire {
 public:
  /// Capacity of a drive's send queue; assumed: three mailboxes of a controller, and a queue.
  static constexpr std::size_t kDriveQueue = 16;

  /// Bits of the error delimiter after a destroyed frame. The bit error is assumed in the CRC. The
  /// receivers' error flags begin after the ACK delimiter (ISO 11898-1), in place of the 7-bit end
  /// of frame. The sender's flag follows one bit later; all flags together take 7 bits. So they end
  /// where the frame would have ended. The delimiter and the intermission follow.
  static constexpr int kErrorDelimiterBits = 8;
  /// As kErrorDelimiterBits, after a frame that no node acknowledges. The sender's error flag of 6
  /// bits begins after the ACK slot, in place of the last 8 bits of the frame.
  static constexpr int kNoAckBits = 6 + kErrorDelimiterBits - 8;
  /// Extra wait of an error-passive sender (ISO 11898-1, suspend transmission).
  static constexpr int kSuspendBits = 8;
  /// Bits that a controller counts before it recovers from bus-off (ISO 11898-1).
  static constexpr int kRecoveryBits = 128 * 11;

  /// `bitrate` in bit/s; 0: frames take no time and do not wait. `host_queue`: capacity of the
  /// hosts' send queue, frames.
  explicit CanWire(std::int64_t bitrate, std::size_t host_queue = HostQueue::kDefaultFrames);

  std::int64_t bitrate() const { return bitrate_; }
  bool host_queue_full() const { return host_count_ == hosts_.size(); }
  std::size_t host_queue_size() const { return host_count_; }
  /// Number of host frames that are ready for the wire at `now`; the others are still in an
  /// adapter.
  std::size_t host_frames_ready(SimTime now) const;
  /// Queues a host's frame, ready at `at`. Pre: the queue is not full; `frame` is kData or kRemote.
  /// `sender` becomes WireDelivery::owner.
  void send_from_host(SimTime at, const protocol::Frame& frame, std::uint32_t sender = 0);
  // `owner` identifies the sending drive (DriveLink::owner), whatever identifier its frames have.

  /// Drops the oldest frame of a host that is not on the wire at `now`. Returns false if there is
  /// none.
  bool drop_oldest_from_host(SimTime now);
  /// Drops all frames of hosts, and returns their number. A frame that began by `now` occupies the
  /// wire to its end.
  std::size_t drop_from_hosts(SimTime now);

  /// The drive has kDriveQueue frames pending, counting `elsewhere` frames that it holds outside of
  /// this queue. It then accepts no query.
  bool drive_queue_full(std::uint32_t owner, std::size_t elsewhere = 0) const;
  /// Number of pending frames of all drives.
  std::size_t drive_frames() const { return drives_.size(); }
  /// Number of copies of this frame of the drive that are pending or on the wire.
  std::size_t copies(std::uint32_t owner, const protocol::Frame& frame) const;
  /// Queues a drive's frame, ready at `at`. Pre: the drive's queue is not full. `after_rom_write`
  /// is passed on to the delivery.
  void send_from_drive(SimTime at, const protocol::Frame& frame,
                       std::uint64_t after_rom_write = 0) {
    send_from_drive(at, frame, after_rom_write, frame.id, false);
  }
  /// Queues a frame with a given owner. A blocked frame does not arbitrate until `release`.
  void send_from_drive(SimTime at, const protocol::Frame& frame, std::uint64_t after_rom_write,
                       std::uint32_t owner, bool blocked);
  /// Blocks the drive's pending frames, except one that began before `now`. Returns the number of
  /// blocked frames.
  std::size_t block(std::uint32_t owner, SimTime now);
  void release(std::uint32_t owner, SimTime now);

  /// Start of the next frame if a drive sends it, else nullopt. `next_due` is the end of the frame.
  std::optional<SimTime> next_reply_start() const {
    return next_ && next_->drive ? std::optional(next_->start) : std::nullopt;
  }
  /// More than one frame is pending or on the wire.
  bool several_wait() const { return host_count_ + drives_.size() > 1; }
  /// Drops the frames of a drive that lost its power, and returns their number. A frame that began
  /// by `now` is not delivered, but occupies the wire to its end.
  std::size_t drop_replies(std::uint32_t owner, SimTime now);

  /// End of the next frame, unless a frame that is queued before its start wins the arbitration;
  /// nullopt if no frame is pending.
  std::optional<SimTime> next_due() const {
    return next_ ? std::optional(next_->end) : std::nullopt;
  }
  /// Pre: a frame is pending.
  bool next_is_from_host() const { return !next_->drive; }
  /// Removes and returns the next frame if its last bit ends by `until`. The next frame is not
  /// fixed before: any frame that is ready at the start of the arbitration takes part.
  std::optional<WireDelivery> deliver(SimTime until);
  /// Pre: a frame is pending. The frame that `deliver` would return.
  WireCandidate next() const;
  /// Call instead of `deliver`: a bit error destroys the next frame. The sender retries, at the
  /// earliest `pause_bits` after the error frame, which ends `error_bits` after the frame.
  void destroy(int pause_bits, int error_bits = kErrorDelimiterBits);
  /// As `destroy`, but the sender gives the frame up. If hosts sent it, their next frame starts at
  /// the earliest `pause_bits` after the error frame.
  void destroy_for_good(int pause_bits);

  /// Time for which the wire was occupied so far, inter-frame spaces included.
  SimTime busy() const { return busy_; }

 private:
  /// A Frame without room for RS-485 packets. It is small because a copy of a bus copies the whole
  /// ring buffer of frames.
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
    SimTime at{0};         // earliest start
    SimTime queued_at{0};  // before any repetition
    CanFrame frame;
    std::uint64_t after_rom_write = 0;
    std::uint32_t owner = 0;
    bool blocked = false;
    std::uint32_t priority = 0;  // arbitration field; the lowest wins
    SimTime length{0};           // from the first to the last bit
    SimTime occupancy{0};        // length plus the inter-frame space
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
  void break_off(const Transmission& transmission, int error_bits);
  Waiting& host(std::size_t n) { return hosts_[(host_head_ + n) % hosts_.size()]; }
  SimTime host_ready() const { return std::max(hosts_[host_head_].at, hosts_from_); }

  std::int64_t bitrate_;
  SimTime free_at_{0};
  SimTime hosts_from_{0};  // end of the bus-off time of the hosts' adapter
  SimTime busy_{0};
  std::vector<Waiting> hosts_;  // ring buffer
  std::size_t host_head_ = 0;
  std::size_t host_count_ = 0;
  std::vector<Waiting> drives_;       // in the order of sending
  std::optional<Transmission> next_;  // cached; read more often than it changes
};

}  // namespace lk::emulator
