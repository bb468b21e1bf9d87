#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "emulator/core/bus_config.hpp"
#include "emulator/monitor/advice/advice.hpp"
#include "emulator/monitor/advice/watch_input.hpp"
#include "protocol/wire.hpp"

namespace lk::emulator {

/// Detects several hosts that command one drive. A CAN frame does not name its sender, and one host
/// may alternate values (dither, corrections, noise). But one host sends one frame after the other.
/// Its unusual value replaces a usual one, which leaves a gap in the rhythm of usual values. A
/// second host's frame comes in between and leaves this rhythm unchanged.
class HostsWatch {
 public:
  /// Longest gap in a rhythm of similar commands (assumed).
  static constexpr SimTime kThereAndBack = std::chrono::milliseconds(100);
  static constexpr SimTime kAgain = std::chrono::seconds(1);  // longest gap of signs (assumed)
  static constexpr int kTimes = 8;                            // signs until advice (assumed)

  std::optional<Finding> on_query(const DecodedQuery& query);

 private:
  struct TimedMotion {
    SimTime at{0};
    MotionCommand motion;
  };
  static constexpr std::size_t kKept = 32;
  static constexpr std::size_t kRhythm = 7;  // frames needed for a rhythm (assumed)
  const TimedMotion& recent(std::size_t n) const {
    return commands_[(count_ - 1 - n) % kKept];
  }  // `n` 0: the last command
  bool apart() const;
  bool alike(const MotionCommand& one, const MotionCommand& other) const;
  enum class Sign : std::uint8_t { kNone, kOneHost, kSeveral };
  Sign sign() const;

  std::array<TimedMotion, kKept> commands_{};  // a ring
  std::size_t count_ = 0;
  int times_ = 0;  // signs of several hosts minus signs of one
  SimTime last_time_{0};
};

/// Last frames that a host may have received. A host that does not clear its buffer may send bytes
/// of them again.
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

/// Detects a second drive with this drive's ID, outside this emulator. Its replies have the
/// identifier of queries. But they have a temperature where a query has 0 or a direction, or the
/// value read where a query has zeros. Such replies go on, as each drive takes the other's replies
/// for queries. A host that does not clear unused bytes differs: it sends values in all queries, or
/// bytes it received.
class DuplicateWatch {
 public:
  static constexpr int kTimes = 8;  // replies until advice (assumed)
  /// Longest gap between two replies of the other drive: two passes through a USB adapter and the
  /// reply times of both drives (assumed).
  static constexpr SimTime kApart = std::chrono::milliseconds(4);
  static constexpr int kSteady_C = 2;  // largest change; uncleared bytes vary more (assumed)

  /// Pre: `in` has 8 bytes and is for this drive.
  std::optional<Finding> on_query(const TimedFrame& in, const RecentFrames& recent);

 private:
  /// Consecutive frames that may be replies.
  struct Streak {
    /// Adds a frame and returns the length of the streak. A new streak begins if the frame is not
    /// `alike` the last one, or comes later than kApart.
    int add(const TimedFrame& in, bool alike);

    int times = 0;
    SimTime at{0};  // of the last frame
    protocol::Payload data{};
  };

  std::uint32_t asked_ = 0;  // commands seen in cleared queries; one bit per row of kRows
  Streak warm_;              // replies with a temperature
  Streak reads_;             // replies with a value that was read
};

/// Returns a finding for a command or parameter that this drive does not have. One such frame is
/// enough, as the host may then give up, or wait for ever.
Finding unknown_command(const protocol::Frame& frame, const KnownDrive& drive);

/// Returns true for a 32-bit single-turn target to a drive that reads only 16 bits of it.
bool has_wide_target(const DecodedQuery& query, const KnownDrive& drive);

/// Detects fields that have a meaning only for drives of another generation.
class GenerationWatch {
 public:
  /// Unused bytes may hold anything, but the same plausible iq limit in this many frames in a row
  /// is intended (assumed).
  static constexpr int kSameLimit = 10;

  std::optional<Finding> on_query(const DecodedQuery& query, const KnownDrive& drive);

 private:
  std::optional<Finding> hear_limit(std::int16_t limit_lsb, const KnownDrive& drive);

  std::int16_t limit_lsb_ = 0;
  int same_limit_ = 0;
};

/// Detects hosts that clear errors (0x9B) repeatedly, because the reply shows the old errors.
class ClearWatch {
 public:
  static constexpr SimTime kWithin = std::chrono::seconds(5);
  static constexpr int kTimes = 3;

  std::optional<Finding> on_query(const DecodedQuery& query, const KnownDrive& drive);

 private:
  SimTime first_{0};
  int times_ = 0;
};

}  // namespace lk::emulator
