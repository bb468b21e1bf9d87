#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "emulator/core/bus/wire_frames.hpp"
#include "emulator/core/sim_time.hpp"
#include "protocol/frame.hpp"
#include "protocol/serial_framing.hpp"

namespace lk::emulator {

/// RS-485: two wires for all nodes, no arbitration, ten bits per byte (docs/reference/rs485.md). A
/// node sends at any time; overlapping bytes spoil each other. Hosts are one adapter with a queue,
/// which sends bytes back to back; each drive is a sender with a queue.
///
/// All drives share one receiver: they receive the same bytes. Overlapping bytes become one byte of
/// the sender that began first, spoiled unless they are equal and begin together. Hosts do not
/// receive bytes of hosts. They read all bytes of drives; one that overlaps a host's byte is
/// spoiled.
class SerialWire {
 public:
  static constexpr std::size_t kHostQueue = 1024;
  /// Size of a serial port's transmit buffer on Linux (UART_XMIT_SIZE; USB adapters have the same).
  static constexpr std::size_t kHostBytes = 4096;
  static constexpr std::size_t kDriveQueue = 16;
  static constexpr std::uint32_t kHost = 0;  // owner of frames of hosts

  struct Waiting {
    SimTime at{0};
    protocol::Frame frame;
    std::uint64_t after_rom_write = 0;
    std::uint32_t owner = kHost;
    bool blocked = false;
  };
  /// A frame on the wire, or about to be.
  struct Sending {
    Sending(const Waiting& what, SimTime free_at, std::int64_t bitrate);
    /// Start of the byte with this index, which is also the end of the previous byte.
    SimTime byte_time(std::size_t byte) const;

    Waiting what;
    std::int64_t bitrate;
    protocol::WireBytes bytes;
    SimTime start;
    SimTime end;
    std::size_t processed = 0;  // number of bytes processed
    // Ends of the overlap with frames that have ended. By member: with any frame; with those that
    // began before this one; with drives' frames among these.
    SimTime covered_until{0};
    SimTime merged_until{0};
    SimTime merged_for_host_until{0};
    std::optional<std::size_t> spoilt = {};                // index of a byte that a fault spoils
    bool faults_applied = false;                           // faults have acted on this frame
    bool clean = true;                                     // all processed bytes are as sent
    bool met_host = false;                                 // a byte began while hosts held the line
    std::array<std::uint8_t, protocol::kMaxBytes> read{};  // bytes as the host reads them
    std::size_t read_size = 0;
  };

  /// `bitrate` in bit/s; 0: bytes take no time. `seed` determines spoiled bytes.
  /// `receives_while_replying`: a drive accepts packets until its reply begins.
  SerialWire(std::int64_t bitrate, const protocol::ReceiverRules& rules, std::uint64_t seed,
             bool receives_while_replying = true);

  std::int64_t bitrate() const { return bitrate_; }
  bool host_queue_full() const {
    return host_queue_size() >= kHostQueue || host_bytes_ >= kHostBytes;
  }
  std::size_t host_queue_size() const;
  std::size_t host_frames_ready(SimTime now) const;
  /// Queues a frame, ready at `at`. Pre: `frame` is kSerial or kBytes, and not empty. The number of
  /// the host is ignored: all hosts are one sender.
  void send_from_host(SimTime at, const protocol::Frame& frame, std::uint32_t sender = 0);

  bool drive_queue_full(std::uint32_t owner, std::size_t elsewhere = 0) const;
  std::size_t drive_frames() const;
  std::size_t copies(std::uint32_t owner, const protocol::Frame& frame) const;
  /// The drive misses a packet that ends at `end`: it began to send before `end`, or it has a reply
  /// pending and `receives_while_replying` is false.
  bool cannot_receive(std::uint32_t owner, SimTime end) const;
  void send_from_drive(SimTime at, const protocol::Frame& frame, std::uint64_t after_rom_write,
                       std::uint32_t owner, bool blocked);
  std::size_t block(std::uint32_t owner, SimTime now);
  void release(std::uint32_t owner, SimTime now);
  std::size_t drop_replies(std::uint32_t owner, SimTime now);

  std::optional<SimTime> next_reply_start() const;
  bool several_wait() const { return sending_.size() > 1; }
  /// Time at which the next byte or frame is complete.
  std::optional<SimTime> next_due() const;
  /// Returns the next frame that is complete by `until`. From drives: the bytes as hosts read them.
  /// From hosts: the packet that drives receive, or kBytes if they receive none. Returns nullopt if
  /// no frame is complete yet. Call again until `next_due()` is after `until`.
  std::optional<WireDelivery> deliver(SimTime until);
  /// Pre: `next_due()` has a value. The frame that `deliver` would return; kBytes if the packet is
  /// not known yet.
  WireCandidate next() const;
  /// Returns true once per frame, before the frame's first byte is processed: faults may act on the
  /// frame now.
  bool take_fault_chance();
  /// Spoils one byte of the next frame.
  void spoil_next();

  SimTime busy() const { return busy_; }
  /// Last delivered frame of a host, as the host wrote it.
  const protocol::Frame& written() const { return written_; }
  /// Sets the time for which hosts hold the line after their bytes; 0: they release it at once.
  void hold_line(SimTime behind) { line_hold_ = behind; }
  const protocol::ReceiverStats& receiver_stats() const { return receiver_.stats(); }

 private:
  void begin_next(std::uint32_t owner, SimTime free_at);
  bool goes_by_bytes(const Sending& one) const;
  SimTime due(const Sending& one) const;
  /// Index in sending_ of the frame that is due next; at equal times, of the one that began first.
  std::size_t next_sending() const;
  /// Processes the next byte of `one`. Returns the packet that drives have received with it.
  std::optional<protocol::Frame> process_byte(Sending& one);

  std::int64_t bitrate_;
  bool receives_while_replying_;
  protocol::Receiver receiver_;
  std::uint64_t random_;
  SimTime host_free_at_{0};
  SimTime line_hold_{0};
  protocol::Frame written_;
  SimTime busy_{0};
  std::vector<Sending> sending_;  // next or current frame of each sender that has one
  std::deque<Waiting> hosts_;     // frames of hosts behind the one in sending_
  std::size_t host_bytes_ = 0;    // total size of the frames in hosts_
  std::vector<Waiting> drives_;   // waiting or blocked, in the order of sending
};

}  // namespace lk::emulator
