#pragma once

/// @file Packets of RS-485 (docs/reference/rs485.md), their checksums ("sums"), and the receiver of
/// a drive. A packet to one drive is `3E CMD ID LEN HSUM data DSUM`; a packet to the drives 1..4 is
/// `02 CMD d0..d7 SUM`.

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "protocol/frame.hpp"

namespace lk::protocol {

inline constexpr std::uint8_t kPacketStart = 0x3E;
inline constexpr std::uint8_t kBroadcastStart = 0x02;
inline constexpr std::size_t kHeaderBytes = 5;
inline constexpr std::size_t kBroadcastBytes = 11;

/// Bytes of a frame on the wire.
struct WireBytes {
  std::array<std::uint8_t, kMaxBytes> bytes{};
  std::size_t size = 0;

  std::span<const std::uint8_t> view() const { return {bytes.data(), size}; }
};

/// Returns the checksum of a packet's part: the low byte of the sum of its bytes.
std::uint8_t sum_of(std::span<const std::uint8_t> bytes);

/// Returns the bytes of an RS-485 frame on the wire: a packet with its sums, or the bytes of
/// kBytes. Pre: LEN is below 113.
WireBytes wire_bytes(const Frame& frame);

/// Returns the packet at the start of `bytes`; empty if it is not complete or a sum is wrong. The
/// packet has as many bytes in `bytes` as in its wire_bytes().
std::optional<Frame> packet_at(std::span<const std::uint8_t> bytes);

/// Returns the bytes as one frame: kSerial if they are exactly one packet, else kBytes. Pre: at
/// most kMaxBytes bytes.
Frame bytes_frame(std::span<const std::uint8_t> bytes);

/// Appends the packets in `bytes` to `out`; other bytes between them become kBytes frames.
void append_frames(std::span<const std::uint8_t> bytes, std::vector<Frame>& out);

/// Rules of a drive's receiver (docs/reference/rs485.md; all rules are assumed).
struct ReceiverRules {
  std::uint8_t max_len = kMaxLen;             // a larger LEN is an error
  bool scan = true;                           // true: search a bad header for the next 3E
                                              // false: wait until the line is idle for `gap`
  std::chrono::nanoseconds gap{5'000'000};    // an idle time this long inside a packet drops it
  std::chrono::nanoseconds broadcast_gap{0};  // required idle time before a 02 packet; none inside

  friend bool operator==(const ReceiverRules&, const ReceiverRules&) = default;
};

/// Error counters of a receiver.
struct ReceiverStats {
  std::uint64_t skipped_bytes = 0;       // outside of packets
  std::uint64_t bad_headers = 0;         // the header's sum is wrong
  std::uint64_t too_long = 0;            // LEN above max_len
  std::uint64_t bad_data = 0;            // the data's sum is wrong
  std::uint64_t incomplete_packets = 0;  // packets that were not completed

  friend bool operator==(const ReceiverStats&, const ReceiverStats&) = default;
};

/// Receiver of a drive: converts bytes on the line to packets. Accepts any bytes. Copyable.
class Receiver {
 public:
  explicit Receiver(const ReceiverRules& rules) : rules_(rules) {}

  /// Processes a byte whose start bit begins at `begin` and whose stop bit ends at `end`. Returns
  /// the packet that the byte completes, if any. Pre: calls are in order of time.
  std::optional<Frame> feed(std::uint8_t byte, std::chrono::nanoseconds begin,
                            std::chrono::nanoseconds end);
  /// Returns true if no packet is incomplete and no byte is dropped, so that a packet can start.
  bool idle() const { return size_ == 0 && broadcast_size_ == 0 && !dropping_; }
  const ReceiverStats& stats() const { return stats_; }
  const ReceiverRules& rules() const { return rules_; }

 private:
  std::optional<Frame> feed_packet(std::uint8_t byte);
  std::optional<Frame> feed_broadcast(std::uint8_t byte, bool rested);
  void resync();

  ReceiverRules rules_;
  std::optional<std::chrono::nanoseconds> last_end_;
  std::array<std::uint8_t, kMaxBytes> buffer_{};  // bytes from a 3E on
  std::size_t size_ = 0;
  std::array<std::uint8_t, kBroadcastBytes> broadcast_{};  // bytes from a 02 on
  std::size_t broadcast_size_ = 0;
  ReceiverStats before_broadcast_;  // statistics to restore if these bytes form a 02 packet
  bool dropping_ = false;           // true: drops bytes until the line is idle
  ReceiverStats stats_;
};

}  // namespace lk::protocol
