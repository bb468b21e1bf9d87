#pragma once

/// @file The packets of RS-485 (docs/rs485.md): `3E CMD ID LEN HSUM data DSUM` to one drive,
/// `02 CMD d0..d7 SUM` to the drives 1..4; their sums, and what a drive makes of bytes.

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

/// The bytes of a frame on the wire.
struct WireBytes {
  std::array<std::uint8_t, kMostBytes> bytes{};
  std::size_t size = 0;

  std::span<const std::uint8_t> view() const { return {bytes.data(), size}; }
};

/// The low byte of the sum.
std::uint8_t sum_of(std::span<const std::uint8_t> bytes);

/// Of a frame of RS-485: a packet with its sums, or bytes as they are. LEN is below 113.
WireBytes wire_bytes(const Frame& frame);

/// The packet that begins `bytes`, if all of it is there and its sums are right; how long it is:
/// wire_bytes of it.
std::optional<Frame> packet_at(std::span<const std::uint8_t> bytes);

/// The bytes as one frame: the packet that they are, all of them, or kBytes. No more than
/// kMostBytes.
Frame bytes_frame(std::span<const std::uint8_t> bytes);

/// Bytes that were written at once, as frames: packets, and what is none as kBytes. Appended.
void append_frames(std::span<const std::uint8_t> bytes, std::vector<Frame>& out);

/// How a drive's receiver goes on (docs/rs485.md, all of it assumed).
struct ReceiverRules {
  std::uint8_t max_len = kMostLen;            // a larger LEN is not believed
  bool scan = true;                           // after a bad header the next start is looked for at
                                              // once; else when the line has rested for `gap`
  std::chrono::nanoseconds gap{5'000'000};    // so long a rest inside a packet drops it
  std::chrono::nanoseconds broadcast_gap{0};  // before a 02 packet, and none such inside

  friend bool operator==(const ReceiverRules&, const ReceiverRules&) = default;
};

/// What a receiver dropped.
struct ReceiverStats {
  std::uint64_t skipped_bytes = 0;  // that start no packet
  std::uint64_t bad_headers = 0;    // the header's sum is wrong
  std::uint64_t too_long = 0;       // LEN above max_len
  std::uint64_t bad_data = 0;       // the data's sum is wrong
  std::uint64_t broken_off = 0;     // packets that did not go on

  friend bool operator==(const ReceiverStats&, const ReceiverStats&) = default;
};

/// Bytes of the line to packets. A value; any bytes will do.
class Receiver {
 public:
  explicit Receiver(const ReceiverRules& rules) : rules_(rules) {}

  /// A byte whose start bit begins at `begin` and whose stop bit ends at `end`, not before the one
  /// that came last. Gives the packet that it completes.
  std::optional<Frame> feed(std::uint8_t byte, std::chrono::nanoseconds begin,
                            std::chrono::nanoseconds end);
  /// A packet that comes now is found however the bytes before it ended.
  bool idle() const { return size_ == 0 && broadcast_size_ == 0 && !dropping_; }
  const ReceiverStats& stats() const { return stats_; }
  const ReceiverRules& rules() const { return rules_; }

 private:
  std::optional<Frame> feed_packet(std::uint8_t byte);
  std::optional<Frame> feed_broadcast(std::uint8_t byte, bool rested);
  void resync();

  ReceiverRules rules_;
  std::optional<std::chrono::nanoseconds> last_end_;
  std::array<std::uint8_t, kMostBytes> buffer_{};  // from a 3E on
  std::size_t size_ = 0;
  std::array<std::uint8_t, kBroadcastBytes> broadcast_{};  // from a 02 on
  std::size_t broadcast_size_ = 0;
  ReceiverStats before_broadcast_;  // what its bytes count for as long as they may be others
  bool dropping_ = false;           // until the line rests
  ReceiverStats stats_;
};

}  // namespace lk::protocol
