#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "emulator/advice/advice.hpp"
#include "emulator/core/bus_config.hpp"
#include "protocol/wire.hpp"

namespace lk::emulator {

/// Frames that a host may have received last, and may send again in bytes that it does not clear.
class RecentFrames {
 public:
  /// Assumed: a host may query several drives, then read all replies into one buffer.
  static constexpr std::size_t kKept = 16;

  void keep(const protocol::Frame& frame) { kept_[next_++ % kKept] = frame.data; }
  /// Returns true if a kept frame equals `data` in the bytes of `mask`; bit n is DATA[n].
  bool have(const protocol::Payload& data, unsigned mask) const;

 private:
  std::array<protocol::Payload, kKept> kept_{};
  std::size_t next_ = 0;
};

/// Detects another drive with this drive's ID. Its replies have the identifier of queries, but a
/// temperature where a query has 0 or a direction. Replies to reads have values where a query has
/// zeros. Such frames do not stop, as each drive takes the other's replies for queries. A host that
/// does not clear unused bytes always sends values there, or bytes that it received before.
class DuplicateWatch {
 public:
  static constexpr int kTimes = 8;  // assumed
  /// Longest gap of replies: twice through a USB adapter, and two drives (assumed).
  static constexpr SimTime kApart = std::chrono::milliseconds(4);
  static constexpr int kSteady_C = 2;  // stray bytes vary more (assumed)

  /// Pre: `in` has 8 bytes and is for this drive.
  std::optional<Finding> hear(const TimedFrame& in, const RecentFrames& recent);

 private:
  /// Consecutive frames that may be replies.
  struct Streak {
    /// Returns the length with this frame; 1 if it is not `alike` the last one.
    int add(const TimedFrame& in, bool alike);

    int times = 0;
    SimTime at{0};  // of the last frame
    protocol::Payload data{};
  };

  std::uint32_t asked_ = 0;  // commands also seen as proper queries; one bit per row
  Streak warm_;              // with a temperature
  Streak reads_;             // with a value that was read
};

}  // namespace lk::emulator
