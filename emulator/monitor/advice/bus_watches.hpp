#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "emulator/core/bus/bus.hpp"
#include "emulator/core/terminal_flag.hpp"
#include "emulator/monitor/advice/advice.hpp"
#include "emulator/monitor/advice/watch_input.hpp"

namespace lk::emulator {

/// Delays that hosts do not cause: injected faults, a disturbed wire, time that slipped. The queue
/// that grew meanwhile is sent while hosts continue.
class Disturbances {
 public:
  /// Time to send that queue (assumed).
  static constexpr SimTime kAftermath = std::chrono::seconds(1);

  void observe(const Bus& bus, const BusStats& stats);
  /// Notes that time slipped at `now`: frames that hosts sent meanwhile come together.
  void note_slip(SimTime now);
  bool after_slip(SimTime now) const { return now < slip_until_; }
  bool last(SimTime now) const { return now < until_; }
  /// Returns true while a fault delays frames of hosts.
  bool writes_stall(SimTime now) const { return now < stalled_until_; }

 private:
  void extend(SimTime from) { until_ = std::max(until_, from + kAftermath); }

  std::uint64_t foreign_ = 0;  // frames so far that hosts did not cause
  SimTime until_{0};
  SimTime slip_until_{0};
  SimTime stalled_until_{0};
};

/// Detects hosts that send faster than the wire carries.
class WireWatch {
 public:
  /// Two per drive on a full bus: one round of queries is no overload (assumed).
  static constexpr std::uint64_t kWaiting = 64;
  static constexpr SimTime kLong = std::chrono::milliseconds(100);  // assumed

  /// Returns a finding for a host's frame if the wire is overloaded.
  std::optional<Finding> on_query() const;
  void observe(const Bus& bus, const BusStats& stats, bool disturbed);

 private:
  std::optional<SimTime> crowded_since_;
  std::uint64_t waiting_ = 0;
  std::uint64_t lost_ = 0;  // total so far
  bool too_fast_ = false;
};

/// Detects queries that do not wait for the previous reply. `in_a_row`: their number so far.
std::optional<Finding> not_waited(const DecodedQuery& query, const KnownDrive& drive,
                                  int& in_a_row);

/// Detects pauses that trip, or nearly trip, the lost-input protection. `pauses`: their number.
std::optional<Finding> near_timeout(const DecodedQuery& query, const KnownDrive& drive,
                                    int& pauses);

/// Detects a step that the motor cannot follow in a stream of targets (0xA3, 0xA4).
class JumpWatch {
 public:
  static constexpr SimTime kStream = std::chrono::milliseconds(50);  // between targets (assumed)
  static constexpr int kMoving = 8;        // changed targets in a row (assumed)
  static constexpr double kTooFast = 1.5;  // times the possible speed: room for jitter (assumed)
  static constexpr double kLeast_deg = 1;  // smaller steps do no harm (assumed)
  static constexpr SimTime kPause = std::chrono::seconds(1);  // then a new stream starts (assumed)

  std::optional<Finding> on_query(const DecodedQuery& query, const KnownDrive& drive);

 private:
  struct Target {
    SimTime at{0};
    double value_deg = 0;
  };
  std::optional<Target> last_;
  /// Returns true if the target comes soon after the last because it was delayed before.
  bool catches_up(double gap_s);

  int moving_ = 0;
  double mean_gap_s_ = 0;  // 0: unknown
  double delay_s_ = 0;     // delay of the stream against its rhythm
};

/// Detects increments that accumulate because the shaft does not follow.
class WindUpWatch {
 public:
  static constexpr SimTime kStream = std::chrono::milliseconds(500);  // longest gap (assumed)
  static constexpr int kIncrements = 10;                              // assumed
  static constexpr double kBehind_s = 1;                              // lag of the shaft (assumed)

  std::optional<Finding> on_query(const DecodedQuery& query, const KnownDrive& drive);
  /// Call after each observation of the drive.
  void observe(const KnownDrive& drive);

 private:
  struct Run {
    SimTime from{0};
    SimTime last{0};
    bool forward = true;
    int count = 0;
    double commanded_deg = 0;
    std::optional<double> shaft_from_deg = std::nullopt;  // at the first observation
  };
  std::optional<Run> run_;
};

/// Watches hosts that use a drive which is off or has an error.
class TroubleWatch {
 public:
  /// A host that asks for errors sees one within this time; a host that does not gets advice.
  static constexpr SimTime kUnseen = std::chrono::seconds(2);  // assumed
  /// Frames sent before a host can react are no mistake.
  static constexpr SimTime kReaction = std::chrono::milliseconds(100);  // assumed
  static constexpr int kQueries = 10;                                   // assumed
  /// A host that pauses for longer may return; one that did not, and is silent so long, has left.
  static constexpr SimTime kPause = std::chrono::seconds(1);    // assumed
  static constexpr SimTime kSilence = std::chrono::seconds(5);  // assumed
  /// An error seen at an observation may be in the answer to a query of at most this age.
  static constexpr SimTime kLookedLate = std::chrono::milliseconds(5);

  std::optional<Finding> on_query(const DecodedQuery& query, const Suspect& suspect,
                                  const KnownDrive& drive);

  struct Seen {
    Finding finding;
    Suspect suspect;
    std::uint64_t times;
  };
  /// Call after each observation of the drive, at `now`. `arrived`: number of the last frame that
  /// it had received. Returns refused commands, or that the host left it in error.
  std::optional<Seen> observe(SimTime now, std::uint64_t arrived, const KnownDrive& drive);
  /// Returns true if the drive must be looked at without frames for it.
  bool waits() const { return error_ && error_->had_steady_traffic && !error_->is_handled; }

 private:
  struct Error {
    SimTime since{0};
    std::optional<SimTime> asked = std::nullopt;  // by 0x9A or 0x9B
    bool is_handled = false;                      // by these, or by 0x80 or 0x88
    int queries = 0;                              // since kUnseen has passed
    bool had_steady_traffic = false;              // for kUnseen, no pause, state not read
  };
  std::optional<Seen> check_abandoned(SimTime now, const KnownDrive& drive);
  bool should_report(SimTime now) const;
  /// Returns the first of the last `times` refused commands with numbers in (`before`, `arrived`].
  const Suspect& first_of(std::uint64_t times, std::uint64_t before, std::uint64_t arrived) const;

  std::optional<Error> error_;
  std::optional<SimTime> asked_;  // a query of its state, error or not
  Suspect last_;                  // last frame for the drive
  SimTime traffic_since_{0};      // without a pause
  SimTime quiet_until_{0};
  std::uint64_t refused_ = 0;  // total so far
  std::uint64_t arrived_ = 0;
  bool off_ = false;  // last switched off, not on
  struct Motion {
    Suspect suspect;
    bool off = false;
  };
  static constexpr std::size_t kKept = 32;  // more than the wire carries between looks
  std::array<Motion, kKept> motions_{};     // a ring
  std::size_t motion_count_ = 0;
};

/// Returns the effect of such a terminal setting on packets.
Finding not_raw(TerminalFlag flag);

/// Finds an RS-485 packet with the length of CAN, or 0x95 without its payload.
std::optional<Finding> wrong_payload(const protocol::Frame& frame, const KnownDrive& drive);

/// Detects hosts that send while a drive replies on an RS-485 line.
class TalkWatch {
 public:
  static constexpr int kTimes = 3;

  /// Processes a host's packet for any drive. `echoes`: hosts read what they send.
  std::optional<Finding> on_query(const TimedFrame& in, bool echoes);
  /// Call after `on_query` if `drive` answers the packet.
  void expect_reply(const TimedFrame& in, const KnownDrive& drive);

 private:
  /// Returns true if the packet ends before the drive's reply to the previous one begins.
  bool is_queued(const TimedFrame& in) const;
  /// End of the packet's last byte, queued after the previous packet.
  SimTime end_of(const TimedFrame& in) const;

  SimTime sent_{0};          // last packet that gets a reply: its time,
  std::uint32_t asked_ = 0;  // its identifier,
  SimTime byte_time_{0};
  SimTime own_end_{0};       // its end
  SimTime reply_begins_{0};  // earliest, of the first pending reply; 0: drives receive nothing
  SimTime reply_ends_{0};    // earliest, of the last pending reply
  int over_ = 0;
  int after_echo_ = 0;
};

/// Packets with checksums by a wrong rule, counted by rule.
using WrongSums = std::array<int, 3>;
/// Processes bytes that are no valid packet. Finds the third packet by one rule, and later ones.
std::optional<Finding> wrong_sum(const protocol::Frame& frame, WrongSums& times);

}  // namespace lk::emulator
