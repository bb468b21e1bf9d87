#pragma once

/// @file Tells queries from replies on a bus, frame by frame: on a live bus later frames are
/// unknown.

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <vector>

#include "emulator/core/sim_time.hpp"
#include "emulator/monitor/frames/frame_words.hpp"
#include "emulator/monitor/frames/log_pairing.hpp"

namespace lk::emulator {

/// A frame of a bus; `at` and `from_host` if the log has them.
struct BusFrame {
  protocol::Frame frame;
  std::optional<SimTime> at;
  std::optional<bool> from_host;
};

/// kUnclear: query or reply, undecidable. kOther: neither, or of no drive.
enum class Role : std::uint8_t { kQuery, kReply, kUnclear, kOther };

/// Interpretation of a frame.
struct FrameInfo {
  Role role = Role::kOther;
  bool sure = true;                  // false: the other role is possible but unlikely
  int drive = 0;                     // 0: several or none
  std::uint32_t query_code = 0;      // command byte, or identifier of a command for several drives
  protocol::Frame frame;             // with the identifier of a query
  std::size_t match_count = 0;       // for a reply: number of matching queries
  std::optional<SimTime> latency{};  // for a reply with one match
};

/// Outcome of a query, reported as soon as it is known.
struct QueryOutcome {
  enum class How : std::uint8_t {
    kAnswered,
    kUnanswered,
    kOpen,  // the log ended, or a frame may have been the reply
  };
  How how = How::kAnswered;
  int drive = 0;
  std::uint32_t query_code = 0;
  protocol::Frame query{};
  std::optional<SimTime> at{};  // of the query
  std::optional<SimTime> latency{};
  bool was_unclear = false;  // its role was unclear; the reply shows it was a query
};

/// Tells queries from replies on one bus (rules: docs/reference/formats.md).
class Conversation {
 public:
  /// Each reader knows all drives, 1 to 32, in one wire format. The first reader that can parse a
  /// frame is used. Pre: `readers` is not empty and outlives this object.
  explicit Conversation(std::span<const FrameReader> readers) : readers_(readers) {}
  FrameInfo classify(const BusFrame& observed);
  /// Removes the times of pending frames, as they turned out to be wrong.
  void forget_times();
  /// Ends the bus: no more frames come.
  void end();
  /// Returns outcomes since the last call.
  std::vector<QueryOutcome> take_outcomes();

 private:
  struct Pending {
    protocol::Frame query;
    std::uint8_t command = 0;  // of its reply
    std::uint32_t query_code = 0;
    std::optional<SimTime> at;
    bool unclear = false;         // may have been a reply itself
    bool required = true;         // false: a query to several drives, which this one may not answer
    bool maybe_answered = false;  // a frame came that may have been the reply
  };
  struct Drive {
    std::deque<Pending> pending;  // in the order of the replies
    // Replies to one of several equal queries; resolved by the next frame.
    std::vector<std::optional<SimTime>> equal_replies;
    protocol::Frame run_frame;  // first of these replies
    std::uint32_t reply_base = protocol::kSingleDriveId;
    bool seen = false;         // on the bus
    bool is_complete = false;  // first query seen, so the pending list is complete
    bool alive = false;        // a reply is certain, and none was missed since
    SimTime slowest{0};        // longest certain latency; 0: none yet
  };

  const ReplyReader& reader_of(int id, const protocol::Frame& frame) const;
  FrameInfo classify_multi_drive(const BusFrame& observed);
  FrameInfo classify_own_id(int id, std::uint32_t base, const BusFrame& observed);
  FrameInfo classify_single(int id, const BusFrame& observed);
  FrameInfo reply(int id, const BusFrame& observed, const std::vector<std::size_t>& fits,
                  bool sure);
  FrameInfo unclear(int id, const BusFrame& observed);
  FrameInfo query(int id, const BusFrame& observed, bool sure);
  bool could_be_reply(int id, const protocol::Frame& frame) const;
  void add(int id, const Pending& query);
  void ask(int id, const BusFrame& observed, bool unclear);
  std::vector<std::size_t> fitting(int id, const protocol::Frame& frame) const;
  enum class Pace : std::uint8_t { kAsEver, kAny, kTooLate };
  Pace pace_of(int id, const Pending& query, const std::optional<SimTime>& now) const;
  FrameInfo repeat_query(int id, const BusFrame& observed, std::size_t last);
  void expire(int id, const std::optional<SimTime>& now);
  void settle_run(int id);
  void settle_first(int id, QueryOutcome::How how,
                    const std::optional<SimTime>& replied_at = std::nullopt);

  Drive& drive(int id) { return drives_[static_cast<std::size_t>(id - protocol::kMinId)]; }
  const Drive& drive(int id) const {
    return drives_[static_cast<std::size_t>(id - protocol::kMinId)];
  }

  std::span<const FrameReader> readers_;
  std::array<Drive, protocol::kMaxDrivesPerBus> drives_;
  std::vector<QueryOutcome> settled_;
  std::optional<SimTime> first_;  // first stamp
  bool sent_ = false;             // directions seen for frames of drives
  bool received_ = false;
};

}  // namespace lk::emulator
