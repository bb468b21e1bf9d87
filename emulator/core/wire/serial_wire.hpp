#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "emulator/core/sim_time.hpp"
#include "emulator/core/wire/wire_frames.hpp"
#include "protocol/frame.hpp"
#include "protocol/serial_framing.hpp"

namespace lk::emulator {

/// RS-485: two wires for all, no arbitration, ten bits a byte (docs/rs485.md). Whoever wants to
/// send sends; bytes of several at once spoil each other. Hosts are one adapter with a queue, whose
/// bytes stand back to back; each drive is a sender with a queue.
///
/// What drives hear is one receiver: all of them hear the same bytes. Bytes that overlap are one,
/// that of the sender which began first, and spoiled, unless they are equal and begin together.
/// Hosts do not hear themselves: bytes of drives that meet theirs are spoiled, and all there.
class SerialWire {
 public:
  static constexpr std::size_t kHostQueue = 1024;
  /// Size of a serial port's transmit buffer on Linux (UART_XMIT_SIZE; USB adapters have the same).
  static constexpr std::size_t kHostBytes = 4096;
  static constexpr std::size_t kDriveQueue = 16;

  /// `bitrate` in bit/s; 0 = bytes take no time. `seed` gives what spoiled bytes are.
  /// `hears_while_replying`: a drive whose reply has not begun takes in another packet.
  SerialWire(std::int64_t bitrate, const protocol::ReceiverRules& rules, std::uint64_t seed,
             bool hears_while_replying = true);

  std::int64_t bitrate() const { return bitrate_; }
  SimTime bits(int count) const;

  bool host_queue_full() const {
    return host_queue_size() >= kHostQueue || host_bytes_ >= kHostBytes;
  }
  std::size_t host_queue_size() const { return hosts_.size() + (host_sends() ? 1 : 0); }
  std::size_t host_frames_ready(SimTime now) const;
  /// From `at` on, behind what hosts sent before. `frame` is kSerial or kBytes, and not empty.
  void send_from_host(SimTime at, const protocol::Frame& frame);

  bool drive_queue_full(std::uint32_t owner, std::size_t elsewhere = 0) const;
  std::size_t drive_frames() const;
  std::size_t copies(std::uint32_t owner, const protocol::Frame& frame) const;
  /// The drive does not hear a packet that ends at `end`: its transmitter was on during the packet,
  /// or a reply waits and `hears_while_replying` is false.
  bool is_deaf(std::uint32_t owner, SimTime end) const;
  void send_from_drive(SimTime at, const protocol::Frame& frame, std::uint64_t after_rom_write,
                       std::uint32_t owner, bool blocked);
  std::size_t block(std::uint32_t owner, SimTime now);
  void release(std::uint32_t owner, SimTime now);
  std::size_t forget_replies(std::uint32_t owner, SimTime now);

  std::optional<SimTime> next_reply_start() const;
  bool several_wait() const { return sending_.size() > 1; }
  /// When the next bytes are heard.
  std::optional<SimTime> next_due() const;
  /// What is due by `until`: of drives, what the host reads; of hosts, a packet as drives hear it,
  /// or kBytes when a frame of theirs was none. Nothing also where bytes went by that make neither.
  std::optional<WireDelivery> deliver(SimTime until);
  /// What deliver would give; kBytes where that is not known yet. Something must be due.
  WireCandidate next() const;
  /// Whether faults have to say something of what is due: once of each frame, before it is heard.
  bool take_judgement();
  /// One of its bytes is spoiled.
  void spoil_next();

  SimTime busy() const { return busy_; }
  /// The host's frame that was delivered last, as it wrote it.
  const protocol::Frame& written() const { return written_; }
  /// How long after a host's bytes the line stays blocked; 0: it is released at once.
  void keep_line(SimTime behind) { keeps_line_ = behind; }
  const protocol::ReceiverStats& receiver_stats() const { return receiver_.stats(); }

 private:
  struct Waiting {
    SimTime at{0};
    protocol::Frame frame;
    std::uint64_t after_rom_write = 0;
    std::uint32_t owner = kHost;
    bool blocked = false;
  };
  /// On the wire, or about to be.
  struct Sending {
    Waiting what;
    SimTime start{0};
    SimTime end{0};
    protocol::WireBytes bytes;
    std::size_t heard = 0;  // of them
    // One that has ended overlapped it until then, and began first: of a drive, for hosts too.
    SimTime covered_until{0};
    SimTime merged_until{0};
    SimTime merged_for_host_until{0};
    std::optional<std::size_t> spoilt = {};                 // this byte, by a fault
    bool judged = false;                                    // faults have had their say
    bool clean = true;                                      // as sent, so far
    bool met_host = false;                                  // who kept the line
    std::array<std::uint8_t, protocol::kMostBytes> read{};  // by the host
    std::size_t read_size = 0;
  };
  static constexpr std::uint32_t kHost = 0;

  /// Hosts keep the line at `at`, behind what they sent.
  bool host_keeps(SimTime at) const { return at < host_free_at_ + keeps_line_; }
  SimTime byte_time(const Sending& one, std::size_t byte) const;
  bool host_sends() const;
  std::size_t of_drive(std::uint32_t owner) const;
  Sending begin(const Waiting& what, SimTime free_at) const;
  void begin_next(std::uint32_t owner, SimTime free_at);
  bool overlaps(const Sending& one) const;
  bool goes_by_bytes(const Sending& one) const;
  SimTime due(const Sending& one) const;
  const Sending* next_sending() const;
  Sending& next_of_all() {
    return sending_[static_cast<std::size_t>(next_sending() - sending_.data())];
  }
  /// `first` began earlier, or is heard if both began together.
  static bool is_first(const Sending& first, const Sending& second) {
    return first.start < second.start || (first.start == second.start && &first < &second);
  }
  /// What `ended` has on the line covers what `other` has.
  static void cover(const Sending& ended, Sending& other, SimTime until);
  /// The next byte of `one` is on the line. Gives the packet that drives have heard with it.
  std::optional<protocol::Frame> hear_byte(Sending& one);
  WireDelivery delivery_of(const Sending& one, const std::optional<protocol::Frame>& packet) const;

  std::int64_t bitrate_;
  bool hears_while_replying_;
  protocol::Receiver receiver_;
  std::uint64_t random_;
  SimTime host_free_at_{0};
  SimTime keeps_line_{0};
  protocol::Frame written_;
  SimTime busy_{0};
  std::vector<Sending> sending_;  // at most one of each sender
  std::deque<Waiting> hosts_;     // behind the one that is being sent
  std::size_t host_bytes_ = 0;    // in hosts_
  std::vector<Waiting> drives_;   // the same, in the order in which they were sent; and the blocked
};

}  // namespace lk::emulator
