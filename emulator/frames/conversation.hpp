#pragma once

/// @file Who says what on a bus, frame by frame as they come: a live bus does not tell what
/// follows.

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <vector>

#include "emulator/core/sim_time.hpp"
#include "emulator/frames/frame_words.hpp"
#include "emulator/frames/reply_fit.hpp"

namespace lk::emulator {

/// A frame of a bus; `at` and `from_host` if the log says so.
struct HeardFrame {
  protocol::Frame frame;
  std::optional<SimTime> at;
  std::optional<bool> from_host;
};

/// kUnclear: query or reply, nobody can know. kOther: neither, or of no drive.
enum class Role : std::uint8_t { kQuery, kReply, kUnclear, kOther };

/// What a frame is.
struct Told {
  Role role = Role::kOther;
  bool sure = true;         // false: it could be the other thing, but hardly
  int drive = 0;            // 0: several, or none
  std::uint32_t asked = 0;  // the command byte, or the identifier of a command for several drives
  protocol::Frame frame;    // with the identifier of queries
  std::size_t choices = 0;  // of a reply: queries that it may belong to
  std::optional<SimTime> latency{};  // of a reply to the only one
};

/// What has become of a query, as soon as it is known.
struct Settled {
  enum class How : std::uint8_t {
    kAnswered,
    kUnanswered,
    kOpen,  // the log ended, or something came that may have been the reply
  };
  How how = How::kAnswered;
  int drive = 0;
  std::uint32_t asked = 0;
  protocol::Frame query{};
  std::optional<SimTime> at{};  // of the query
  std::optional<SimTime> latency{};
  bool was_unclear = false;  // the query: since it was answered it was one
};

/// Tells queries from replies on one bus (docs/decode.md has the rules).
class Conversation {
 public:
  /// Each reader knows all drives, 1 to 32, on the wire of the frames. The first of them that can
  /// read a frame does. Outlived by `readers`, which are at least one.
  explicit Conversation(std::span<const FrameReader> readers) : readers_(readers) {}
  Told hear(const HeardFrame& heard);
  /// Times turned out to be wrong: what waits has none.
  void forget_times();
  /// Nothing comes any more.
  void end();
  /// What has been settled since this was asked last.
  std::vector<Settled> take_settled();

 private:
  struct Pending {
    protocol::Frame query;
    std::uint8_t command = 0;  // of the reply
    std::uint32_t asked = 0;
    std::optional<SimTime> at;
    bool unclear = false;         // may have been a reply itself
    bool required = true;         // false: for several drives, of which this one need not answer
    bool maybe_answered = false;  // something came that may have been the reply
  };
  struct Drive {
    std::deque<Pending> pending;  // in the order in which it is to answer
    // Replies that belong to one of several queries: known when the next frame comes.
    std::vector<std::optional<SimTime>> run;
    protocol::Frame run_frame;  // the first of them
    std::uint32_t reply_base = protocol::kSingleDriveId;
    bool seen = false;   // on the bus
    bool begun = false;  // its first query is known, so what waits for a reply is too
    bool alive = false;  // has surely answered, and missed nothing since
    SimTime slowest{0};  // of its sure answers; 0: none yet
  };

  const ReplyReader& reader_of(int id, const protocol::Frame& frame) const;
  Told hear_several(const HeardFrame& heard);
  Told hear_own(int id, std::uint32_t base, const HeardFrame& heard);
  Told hear_drive(int id, const HeardFrame& heard);
  Told reply(int id, const HeardFrame& heard, const std::vector<std::size_t>& fits, bool sure);
  Told unclear(int id, const HeardFrame& heard);
  Told query(int id, const HeardFrame& heard, bool sure);
  bool could_be_reply(int id, const protocol::Frame& frame) const;
  void note_direction(const HeardFrame& heard);
  std::optional<bool> direction(const HeardFrame& heard) const;

  void ask(int id, const HeardFrame& heard, bool unclear);
  std::vector<std::size_t> fitting(int id, const protocol::Frame& frame) const;
  enum class Pace : std::uint8_t { kAsEver, kAny, kTooLate };
  Pace pace_of(int id, const Pending& query, const std::optional<SimTime>& now) const;
  Told asked_again(int id, const HeardFrame& heard, std::size_t last);
  void expire(int id, const std::optional<SimTime>& now);
  void settle_run(int id);
  void drop_first(int id, Settled::How how);
  void answer_first(int id, const std::optional<SimTime>& at);

  Drive& drive(int id) { return drives_[static_cast<std::size_t>(id - protocol::kMinId)]; }
  const Drive& drive(int id) const {
    return drives_[static_cast<std::size_t>(id - protocol::kMinId)];
  }

  std::span<const FrameReader> readers_;
  std::array<Drive, protocol::kMaxDrivesPerBus> drives_;
  std::vector<Settled> settled_;
  std::optional<SimTime> first_;  // stamp
  bool sent_ = false;             // frames of drives went both ways
  bool received_ = false;
};

}  // namespace lk::emulator
