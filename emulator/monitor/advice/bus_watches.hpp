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

/// Tracks delays that hosts do not cause: injected faults, a disturbed wire, slipped time. Frames
/// queued during a delay are sent after it, while hosts continue to send.
class Disturbances {
 public:
  /// Time after a delay in which the queued frames are sent (assumed).
  static constexpr SimTime kAftermath = std::chrono::seconds(1);

  void observe(const Bus& bus, const BusStats& stats);
  /// Notes a slip of simulated time that ended at `now`: frames sent during it come together.
  void note_slip(SimTime now);
  bool after_slip(SimTime now) const { return now < slip_until_; }
  /// Returns true during a delay and for kAftermath after it.
  bool last(SimTime now) const { return now < until_; }
  /// Returns true while a fault delays frames of hosts.
  bool writes_stall(SimTime now) const { return now < stalled_until_; }

 private:
  void extend(SimTime from) { until_ = std::max(until_, from + kAftermath); }

  std::uint64_t foreign_ = 0;  // extra frames and error frames so far: hosts did not cause them
  SimTime until_{0};
  SimTime slip_until_{0};
  SimTime stalled_until_{0};
};

/// Detects hosts that send faster than the wire carries.
class WireWatch {
 public:
  /// More waiting frames are an overload. One round of queries is none: two per drive on a full bus
  /// (assumed).
  static constexpr std::uint64_t kWaiting = 64;
  static constexpr SimTime kLong = std::chrono::milliseconds(100);  // of overload (assumed)

  /// Returns a finding for a host's frame if the wire is overloaded.
  std::optional<Finding> on_query() const;
  void observe(const Bus& bus, const BusStats& stats, bool disturbed);

 private:
  std::optional<SimTime> crowded_since_;
  std::uint64_t waiting_ = 0;
  std::uint64_t lost_ = 0;  // frames so far that found the send queue full
  bool too_fast_ = false;
};

/// Detects queries that do not wait for the previous reply. `in_a_row`: count of such queries to
/// this drive, which the caller keeps.
std::optional<Finding> not_waited(const DecodedQuery& query, const KnownDrive& drive,
                                  int& in_a_row);

/// Detects pauses that trip, or nearly trip, the lost-input protection. `pauses`: count of such
/// pauses of this drive, which the caller keeps.
std::optional<Finding> near_timeout(const DecodedQuery& query, const KnownDrive& drive,
                                    int& pauses);

/// Detects a step that the motor cannot follow in a stream of targets (0xA3, 0xA4).
class JumpWatch {
 public:
  static constexpr SimTime kStream = std::chrono::milliseconds(50);  // longest gap (assumed)
  static constexpr int kMoving = 8;        // changed targets in a row make a stream (assumed)
  static constexpr double kTooFast = 1.5;  // times the possible speed: room for jitter (assumed)
  static constexpr double kLeast_deg = 1;  // smaller steps do no harm (assumed)
  static constexpr SimTime kPause = std::chrono::seconds(1);  // longer: a new stream (assumed)

  std::optional<Finding> on_query(const DecodedQuery& query, const KnownDrive& drive);

 private:
  struct Target {
    SimTime at{0};
    double value_deg = 0;
  };
  std::optional<Target> last_;
  /// Returns true if the target comes early because the stream makes up for a delay. `gap_s`: time
  /// since the last target.
  bool catches_up(double gap_s);

  int moving_ = 0;         // changed targets in a row
  double mean_gap_s_ = 0;  // 0: unknown
  double delay_s_ = 0;     // part of the last delay that the stream has not made up
};

/// Detects increments that accumulate because the shaft does not follow.
class WindUpWatch {
 public:
  static constexpr SimTime kStream = std::chrono::milliseconds(500);  // longest gap (assumed)
  static constexpr int kIncrements = 10;  // more in a row can get advice (assumed)
  static constexpr double kBehind_s = 1;  // lag of the shaft, at the commanded speed (assumed)

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
  /// A host that polls for errors does so at least this often. Any other host gets advice once an
  /// error is this old.
  static constexpr SimTime kUnseen = std::chrono::seconds(2);  // assumed
  /// Frames sent before a host can react are no mistake.
  static constexpr SimTime kReaction = std::chrono::milliseconds(100);  // assumed
  static constexpr int kQueries = 10;  // after kUnseen, until advice (assumed)
  /// Traffic with longer gaps than kPause is not steady: its host may return after any gap. A host
  /// with steady traffic that sends nothing for kSilence has left.
  static constexpr SimTime kPause = std::chrono::seconds(1);    // assumed
  static constexpr SimTime kSilence = std::chrono::seconds(5);  // assumed
  /// An observation sees an error late: the reply to a query that is at most this old may already
  /// have shown it.
  static constexpr SimTime kLookedLate = std::chrono::milliseconds(5);

  std::optional<Finding> on_query(const DecodedQuery& query, const Suspect& suspect,
                                  const KnownDrive& drive);

  struct Seen {
    Finding finding;
    Suspect suspect;
    std::uint64_t times;
  };
  /// Call after each observation of the drive, made at `now`. `arrived`: number of the last frame
  /// that was no longer waiting for the wire. Returns a finding on refused motion commands, or on a
  /// host that left the drive with an error.
  std::optional<Seen> observe(SimTime now, std::uint64_t arrived, const KnownDrive& drive);
  /// Returns true if the drive must be observed even if it gets no frames.
  bool waits() const { return error_ && error_->had_steady_traffic && !error_->is_handled; }

 private:
  struct Error {
    SimTime since{0};
    std::optional<SimTime> asked = std::nullopt;  // first 0x9A or 0x9B after the error
    bool is_handled = false;                      // the host sent 0x9A, 0x9B, 0x80 or 0x88
    int queries = 0;                              // since kUnseen has passed
    bool had_steady_traffic = false;  // for kUnseen, without a pause and without a state query
  };
  std::optional<Seen> check_abandoned(SimTime now, const KnownDrive& drive);
  bool should_report(SimTime now) const;
  /// Returns the first refused command, if `times` of the motion commands with numbers in
  /// (`before`, `arrived`] were refused.
  const Suspect& first_of(std::uint64_t times, std::uint64_t before, std::uint64_t arrived) const;

  std::optional<Error> error_;
  std::optional<SimTime> asked_;  // last 0x9A or 0x9B, with or without an error
  Suspect last_;                  // last frame for the drive
  SimTime traffic_since_{0};      // start of the traffic without a pause
  SimTime quiet_until_{0};        // until then, commands refused without an error get no advice
  std::uint64_t refused_ = 0;     // motion commands so far
  std::uint64_t arrived_ = 0;     // as at the last observation
  bool off_ = false;              // the host sent 0x80 after the last 0x88
  struct Motion {
    Suspect suspect;
    bool off = false;  // `off_` when it was sent
  };
  static constexpr std::size_t kKept = 32;  // more than the wire carries between observations
  std::array<Motion, kKept> motions_{};     // a ring
  std::size_t motion_count_ = 0;
};

/// Returns a finding that describes what terminal setting `flag` does to packets.
Finding not_raw(TerminalFlag flag);

/// Finds an RS-485 packet with LEN 7, padded as on CAN, or 0x95 without its payload.
std::optional<Finding> wrong_payload(const protocol::Frame& frame, const KnownDrive& drive);

/// Detects hosts that send while a drive replies on an RS-485 line.
class TalkWatch {
 public:
  static constexpr int kTimes = 3;

  /// Processes a host's packet for any drive. `echoes`: hosts read back what they send.
  std::optional<Finding> on_query(const TimedFrame& in, bool echoes);
  /// Call after `on_query` if `drive` answers the packet.
  void expect_reply(const TimedFrame& in, const KnownDrive& drive);

 private:
  /// Returns true if the packet is for the same drive as the previous packet, and ends before the
  /// reply to that one begins.
  bool is_queued(const TimedFrame& in) const;
  /// End of the packet's last byte, queued after the previous packet.
  SimTime end_of(const TimedFrame& in) const;

  SimTime sent_{0};          // time of the last packet that gets a reply
  std::uint32_t asked_ = 0;  // identifier of that packet
  SimTime byte_time_{0};
  SimTime own_end_{0};       // end of that packet
  SimTime reply_begins_{0};  // earliest begin of the first pending reply; 0: drives do not queue
  SimTime reply_ends_{0};    // earliest end of the last pending reply
  int over_ = 0;             // packets sent during a reply
  int after_echo_ = 0;       // packets sent during a reply, after the echo of the previous packet
};

/// Number of packets whose wrong checksum follows from a known wrong rule, for each rule.
using WrongSums = std::array<int, 3>;
/// Processes bytes that are not a valid packet. Returns a finding from the third packet on that
/// follows the same wrong rule.
std::optional<Finding> wrong_sum(const protocol::Frame& frame, WrongSums& times);

}  // namespace lk::emulator
