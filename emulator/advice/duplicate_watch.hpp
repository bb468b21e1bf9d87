#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "emulator/advice/advice.hpp"
#include "emulator/core/bus_config.hpp"
#include "protocol/wire.hpp"

namespace lk::emulator {

/// What a host on the bus may have received last, and send again in bytes that it does not clear.
class RecentFrames {
 public:
  /// A host may ask several drives at once and then read all replies into one buffer (assumed).
  static constexpr std::size_t kKept = 16;

  void keep(const protocol::Frame& frame) { kept_[next_++ % kKept] = frame.data; }
  /// One of them has the same bytes as `data` at the places of `mask`, bit n for DATA[n].
  bool have(const protocol::Payload& data, unsigned mask) const;

 private:
  std::array<protocol::Payload, kKept> kept_{};
  std::size_t next_ = 0;
};

/// Another drive with the ID of this one. Its replies have this drive's identifier, as queries do,
/// but a temperature where a query has 0 or a direction; and since each drive takes the other's
/// replies for queries, they do not stop. Replies to reads have values where a query has nothing
/// but 0. A host that does not clear unused bytes always has
/// something there, or what it has received before.
class DuplicateWatch {
 public:
  static constexpr int kTimes = 8;  // assumed
  /// From one reply to the next: twice the way through an adapter on USB, and two drives (assumed).
  static constexpr SimTime kApart = std::chrono::milliseconds(4);
  static constexpr int kSteady_C = 2;  // rubbish is not steady (assumed)

  /// `in` has 8 bytes and is for this drive.
  std::optional<Finding> hear(const TimedFrame& in, const RecentFrames& recent);

 private:
  /// What may be replies, in a row.
  struct Streak {
    /// How many there are, with this one; it is the first if not `alike` to the last.
    int add(const TimedFrame& in, bool alike);

    int times = 0;
    SimTime at{0};  // the last, and what it said
    protocol::Payload data{};
  };

  std::uint32_t asked_ = 0;  // commands that came as hosts send them, a bit for each row
  Streak warm_;              // with a temperature
  Streak reads_;             // with what was read
};

}  // namespace lk::emulator
