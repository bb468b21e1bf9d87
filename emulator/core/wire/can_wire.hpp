#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "emulator/core/sim_time.hpp"
#include "emulator/core/wire/wire_frames.hpp"
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

  using Delivery = WireDelivery;
  using Candidate = WireCandidate;

  /// Of the frame that a bit error destroys. The error is taken to be in the CRC: the receivers'
  /// error flags begin behind the ACK delimiter (ISO 11898-1), where the 7 bits of the end of frame
  /// would be; the sender's own follows a bit later, 7 bits together. So the flags end where the
  /// frame would have ended, and the delimiter and the intermission follow.
  static constexpr int kErrorDelimiterBits = 8;
  /// A sender that is error-passive lets others go first (ISO 11898-1, suspend transmission).
  static constexpr int kSuspendBits = 8;
  /// Bits that a controller counts before it comes back from bus-off (ISO 11898-1).
  static constexpr int kRecoveryBits = 128 * 11;

  /// `bitrate` in bit/s; 0 = frames take no time and do not wait for each other.
  explicit CanWire(std::int64_t bitrate);

  std::int64_t bitrate() const { return bitrate_; }
  /// How long so many bits take.
  SimTime bits(int count) const;
  bool host_queue_full() const { return host_count_ == kHostQueue; }
  std::size_t host_queue_size() const { return host_count_; }
  /// Frames of hosts that are ready for the wire at `now`; an adapter has the others.
  std::size_t host_frames_ready(SimTime now) const;
  /// A host's frame waits from `at` on, behind those before it. The queue must not be full; `frame`
  /// is kData or kRemote. `sender` comes back as the owner of what is delivered.
  void send_from_host(SimTime at, const protocol::Frame& frame, std::uint32_t sender = 0);
  // Drives are told apart by the identifier they answer with, their frames' owner, whatever
  // identifier a frame of theirs has.

  /// The drive has so many frames waiting, `elsewhere` included, that it takes nothing in.
  bool drive_queue_full(std::uint32_t owner, std::size_t elsewhere = 0) const;
  /// Frames of all drives.
  std::size_t drive_frames() const { return drives_.size(); }
  /// How many times this frame of the drive waits or is on the wire.
  std::size_t copies(std::uint32_t owner, const protocol::Frame& frame) const;
  /// A drive's frame waits from `at` on. `after_rom_write` is handed through. The drive's queue
  /// must not be full.
  void send_from_drive(SimTime at, const protocol::Frame& frame,
                       std::uint64_t after_rom_write = 0) {
    send_from_drive(at, frame, after_rom_write, frame.id, false);
  }
  /// The same; a blocked frame takes no part until it is released.
  void send_from_drive(SimTime at, const protocol::Frame& frame, std::uint64_t after_rom_write,
                       std::uint32_t owner, bool blocked);
  /// What waits in the drive is blocked, except a frame that has begun before `now`. Gives how
  /// many.
  std::size_t block(std::uint32_t owner, SimTime now);
  void release(std::uint32_t owner, SimTime now);

  /// When the next frame starts if it is a drive's; `next_due` is its end.
  std::optional<SimTime> next_reply_start() const {
    return turn_ && turn_->drive ? std::optional(turn_->start) : std::nullopt;
  }
  /// More than one frame waits or is on the wire.
  bool several_wait() const { return host_count_ + drives_.size() > 1; }
  /// The drive has lost its power, and with it what it wanted to send: so many frames. One that has
  /// begun by `now` is void, and has the wire to its end.
  std::size_t forget_replies(std::uint32_t owner, SimTime now);

  /// When the next frame will have got through, if nothing else is sent; none when nothing waits.
  std::optional<SimTime> next_due() const {
    return turn_ ? std::optional(turn_->end) : std::nullopt;
  }
  /// The next frame, if its last bit is on the wire by `until`; it no longer waits then. Nothing is
  /// decided before: a frame sent later but in time for the arbitration still takes part.
  std::optional<Delivery> deliver(SimTime until);
  /// What `deliver` would give; something must wait.
  Candidate next() const;
  /// Instead of `deliver`: a bit error destroys that frame. It waits on, to be sent again, from
  /// `pause_bits` after the error frame on.
  void destroy(int pause_bits);
  /// The same, and its sender gives it up. A host's next frame waits so many bits.
  void destroy_for_good(int pause_bits);

  /// How long the wire was occupied so far, inter-frame spaces included.
  SimTime busy() const { return busy_; }

 private:
  /// A frame without the room that packets of RS-485 need: a full queue is copied with its bus.
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
    std::uint32_t priority = 0;  // arbitration field, the lower wins
    SimTime length{0};           // up to the last bit
    SimTime occupancy{0};        // and the inter-frame space
  };
  /// Who sends next, and from when to when.
  struct Turn {
    SimTime start;
    SimTime end;
    std::optional<std::size_t> drive;  // index in drives_; none = the head of the hosts' queue
  };

  Waiting waiting(SimTime at, const protocol::Frame& frame) const;
  std::optional<Turn> next_turn() const;
  /// Whatever changes who waits, or since when, ends with this.
  void decide_turn() { turn_ = next_turn(); }
  const Waiting& sender(const Turn& turn) const;
  void remove(const Turn& turn);
  void break_off(const Turn& turn);
  SimTime host_ready() const { return std::max(hosts_[host_head_].at, hosts_from_); }

  std::int64_t bitrate_;
  SimTime free_at_{0};
  SimTime hosts_from_{0};  // their adapter is off the bus before
  SimTime busy_{0};
  std::vector<Waiting> hosts_;  // a ring
  std::size_t host_head_ = 0;
  std::size_t host_count_ = 0;
  std::vector<Waiting> drives_;  // in the order in which they were sent
  std::optional<Turn> turn_;     // as things stand; asked for more often than they change
};

}  // namespace lk::emulator
