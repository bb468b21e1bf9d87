#pragma once

/// @file Tells queries from replies on a bus. Decides frame by frame, without later frames, so that
/// it works on a live bus.

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

/// A frame of a bus. `at` and `from_host` are absent if the log lacks them.
struct BusFrame {
  protocol::Frame frame;
  std::optional<SimTime> at;
  std::optional<bool> from_host;
};

/// kUnclear: query or reply, but it cannot be decided which. kOther: neither, or no drive's frame.
enum class Role : std::uint8_t { kQuery, kReply, kUnclear, kOther };

/// Interpretation of a frame.
struct FrameInfo {
  Role role = Role::kOther;
  bool sure = true;                  // false: the other role is possible but unlikely
  int drive = 0;                     // 0: several or none
  std::uint32_t query_code = 0;      // command byte, or identifier of a command for several drives
  protocol::Frame frame;             // the frame, with the identifier of a query
  std::size_t match_count = 0;       // for a reply: number of matching queries
  std::optional<SimTime> latency{};  // for a reply with one match
};

/// Outcome of a query, reported as soon as it is known.
struct QueryOutcome {
  enum class How : std::uint8_t {
    kAnswered,
    kUnanswered,
    kOpen,  // unknown: the log ended, time ran backwards, or an unclear frame may be the reply
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
  /// Each element of `readers` knows drives 1 to 32 in one wire format. The first one that can
  /// parse a frame is used for it. Pre: `readers` is not empty and outlives this object.
  explicit Conversation(std::span<const FrameReader> readers) : readers_(readers) {}
  FrameInfo classify(const BusFrame& observed);
  /// Removes the times of pending frames. Call if their times turn out to be wrong.
  void forget_times();
  /// Settles all pending queries. Call after the last frame.
  void end();
  /// Returns outcomes since the last call.
  std::vector<QueryOutcome> take_outcomes();

 private:
  struct Pending {
    protocol::Frame query;
    std::uint8_t command = 0;  // DATA[0] of its reply
    std::uint32_t query_code = 0;
    std::optional<SimTime> at;
    bool unclear = false;         // the frame may have been a reply itself
    bool required = true;         // false: this drive may ignore it, a query to several drives
    bool maybe_answered = false;  // a frame came that may have been the reply
  };
  struct Drive {
    std::deque<Pending> pending;  // in the order of the replies
    // Times of a run of replies that each match several pending queries. A later frame shows which.
    std::vector<std::optional<SimTime>> equal_replies;
    protocol::Frame run_frame;  // first reply of that run
    std::uint32_t reply_base = protocol::kSingleDriveId;
    bool seen = false;         // on the bus
    bool is_complete = false;  // `pending` has all queries that can still get a reply
    bool alive = false;        // it has certainly replied, and no reply was missing since
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
  bool sent_ = false;             // a single-drive frame was logged as sent
  bool received_ = false;         // a single-drive frame was logged as received
};

}  // namespace lk::emulator
