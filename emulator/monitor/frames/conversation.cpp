#include "emulator/monitor/frames/conversation.hpp"

#include <algorithm>
#include <utility>

#include "emulator/monitor/frames/log_pairing.hpp"

namespace lk::emulator {
namespace {

using protocol::Frame;
using protocol::Opcode;

/// Maximum of pending queries per drive. A drive queues 16 replies, and hosts wait for few.
constexpr std::size_t kMaxPending = 64;
/// A frame equal to a pending query is the query again or its echo. It is the query if it comes
/// later than kSlower times the drive's slowest reply plus kSlowerBy (assumed).
constexpr int kSlower = 4;
constexpr SimTime kSlowerBy = std::chrono::milliseconds(1);

bool all_zero(const Frame& frame, std::size_t from) {
  return std::all_of(frame.data.begin() + static_cast<std::ptrdiff_t>(from), frame.data.end(),
                     [](std::uint8_t byte) { return byte == 0; });
}

/// Returns true for commands whose queries have only zeros, and whose replies have a value that is
/// rarely 0.
bool zero_is_a_query(std::uint8_t byte) {
  const auto command = static_cast<Opcode>(byte);
  return command == protocol::ReadPid::kOpcode || command == protocol::ReadEncoder::kOpcode ||
         command == protocol::ReadMultiTurnAngle::kOpcode ||
         command == protocol::ReadSingleTurnAngle::kOpcode;
}

/// Returns true if the frame has data that hosts rarely send: the temperature of a state, or the
/// value that was read.
bool looks_like_a_reply(const Frame& frame) {
  if (looks_like_a_state(frame)) return true;
  const auto command = static_cast<Opcode>(frame.data[0]);
  if (command == protocol::ReadParameter::kOpcode) return !all_zero(frame, 2);
  return (zero_is_a_query(frame.data[0]) || command == protocol::ReadAcceleration::kOpcode ||
          command == protocol::WriteZeroToRom::kOpcode) &&
         !all_zero(frame, 1);
}

/// Returns true if the frame looks like a query, whatever the earlier frames were.
bool looks_like_a_query(const Frame& frame) {
  const std::uint8_t command = frame.data[0];
  if (protocol::has_state(command)) {
    return protocol::is_serial(frame) ? !looks_like_a_state(frame) : frame.data[1] <= 1;
  }
  if (static_cast<Opcode>(command) == protocol::Brake::kOpcode) return frame.data[1] > 1;
  return zero_is_a_query(command) && all_zero(frame, 1);
}

/// Returns true if the query writes ROM. Its reply then takes as long as this write.
bool writes_rom(const Frame& query) {
  const auto* const command = protocol::command_of(query);
  return command != nullptr && command->writes_rom;
}

bool can_be_query(const Frame& frame, const ReplyReader& reader) {
  return std::holds_alternative<protocol::Query>(protocol::decode_query(frame, reader.format));
}

bool can_be_reply(const Frame& frame, const ReplyReader& reader) {
  return has_length_of_reply(frame) &&
         std::holds_alternative<protocol::ReplyFrame>(protocol::decode_reply(frame, reader.format));
}

FrameInfo info_of(Role role, int id, const Frame& frame, bool sure) {
  return {.role = role, .sure = sure, .drive = id, .query_code = frame.data[0], .frame = frame};
}

}  // namespace

/// Returns the first reader of the drive that can parse the frame; the first of all if none can.
const ReplyReader& Conversation::reader_of(int id, const Frame& frame) const {
  for (const FrameReader& one : readers_) {
    const ReplyReader& reader = *one.reader_of(id);
    if (can_be_query(frame, reader) || can_be_reply(frame, reader)) return reader;
  }
  return *readers_.front().reader_of(id);
}

FrameInfo Conversation::classify(const BusFrame& observed) {
  if (!first_) first_ = observed.at;
  const Frame& frame = observed.frame;
  if (!is_data(frame)) return {.frame = frame};
  if (protocol::find_multi_drive(frame.id) != nullptr) return classify_multi_drive(observed);
  if (const int id = protocol::drive_at(frame.id, protocol::kSingleDriveId)) {
    if (observed.from_host) (*observed.from_host ? sent_ : received_) = true;
    return classify_single(id, observed);
  }
  if (protocol::is_serial(frame)) return {.frame = frame};  // its ID is above 32
  for (const std::uint32_t base : protocol::kReplyIdBases) {
    if (const int id = protocol::drive_at(frame.id, base))
      return classify_own_id(id, base, observed);
  }
  return {.frame = frame};
}

/// Adds a query to several drives to each drive that may reply. The log does not show which of them
/// accept it.
FrameInfo Conversation::classify_multi_drive(const BusFrame& observed) {
  const ReplyReader& any = *readers_.front().reader_of(protocol::kMinId);
  const auto query = protocol::decode_query(observed.frame, any.format);
  for (int id = protocol::kMinId; id <= protocol::kMaxId; ++id) {
    if (!std::holds_alternative<protocol::Query>(query)) break;
    if (id > protocol::kMultiDriveSlots && !drive(id).seen) continue;
    const auto own = protocol::for_drive(id, std::get<protocol::Query>(query), any.format);
    if (!std::holds_alternative<protocol::Query>(own)) continue;
    const auto command = protocol::reply_command(std::get<protocol::Query>(own).command);
    if (!command) continue;
    expire(id, observed.at);
    settle_run(id);
    add(id, {.query = observed.frame,
             .command = *command,
             .query_code = observed.frame.id,
             .at = observed.at,
             .required = false});
  }
  return {.role = Role::kQuery, .query_code = observed.frame.id, .frame = observed.frame};
}

/// Classifies a frame with a separate identifier for replies. Other devices may use this
/// identifier, so the first such frame must match a pending query.
FrameInfo Conversation::classify_own_id(int id, std::uint32_t base, const BusFrame& observed) {
  BusFrame own = observed;
  own.frame.id = protocol::kSingleDriveId + static_cast<std::uint32_t>(id);
  expire(id, observed.at);
  const auto fits = fitting(id, own.frame);
  if (fits.empty() && drive(id).reply_base != base) return {.frame = observed.frame};
  drive(id).reply_base = base;
  return reply(id, own, fits, true);
}

FrameInfo Conversation::classify_single(int id, const BusFrame& observed) {
  Drive& own = drive(id);
  expire(id, observed.at);
  own.seen = true;
  const bool late = observed.at && first_ && *observed.at - *first_ > kLongestReply;
  own.is_complete = own.is_complete || late;
  // The drive replies with this identifier: an earlier frame with a separate one was another's.
  if (looks_like_a_state(observed.frame) && !fitting(id, observed.frame).empty()) {
    own.reply_base = protocol::kSingleDriveId;
  }
  // Directions are relative to the logging machine; they are useful only if both occur.
  const auto from_host = own.reply_base != protocol::kSingleDriveId ? std::optional(true)
                         : sent_ && received_                       ? observed.from_host
                                                                    : std::nullopt;
  if (from_host == true) return query(id, observed, true);
  const auto fits = fitting(id, observed.frame);
  if (from_host == false) return reply(id, observed, fits, true);
  if (!could_be_reply(id, observed.frame)) {
    if (can_be_query(observed.frame, reader_of(id, observed.frame)))
      return query(id, observed, true);
    return unclear(id, observed);
  }
  if (!fits.empty()) {
    const Fit best = reply_fit(reader_of(id, observed.frame), own.pending[fits.front()].command,
                               own.pending[fits.front()].query, observed.frame);
    if (best == Fit::kYes) return reply(id, observed, fits, true);
    // The frame equals the query: it is the reply (an echo), or the query again.
    const Pace pace = pace_of(id, own.pending[fits.back()], observed.at);
    if (pace == Pace::kTooLate) return repeat_query(id, observed, fits.back());
    if ((own.alive || pace == Pace::kAsEver) && !zero_is_a_query(observed.frame.data[0]))
      return reply(id, observed, fits, false);
    return unclear(id, observed);
  }
  if (looks_like_a_reply(observed.frame) ||
      !can_be_query(observed.frame, reader_of(id, observed.frame))) {
    return reply(id, observed, fits, false);
  }
  if (own.is_complete || looks_like_a_query(observed.frame)) return query(id, observed, true);
  return unclear(id, observed);
}

/// Returns true if the frame may be a reply. A state at 0 or 1 °C does not count, as it looks like
/// a query.
bool Conversation::could_be_reply(int id, const Frame& frame) const {
  return can_be_reply(frame, reader_of(id, frame)) &&
         (!looks_like_a_query(frame) || zero_is_a_query(frame.data[0]));
}

FrameInfo Conversation::reply(int id, const BusFrame& observed,
                              const std::vector<std::size_t>& fits, bool sure) {
  Drive& own = drive(id);
  FrameInfo info = info_of(Role::kReply, id, observed.frame, sure);
  info.match_count = fits.size();
  own.seen = true;
  own.alive = own.alive || sure;
  if (!own.equal_replies.empty() && fitting(id, own.run_frame) != fits) {
    settle_run(id);
    return reply(id, observed, fitting(id, observed.frame), sure);
  }
  if (fits.empty()) return info;
  // Drives answer in order: earlier queries than the first match remain unanswered.
  for (std::size_t n = 0; n < fits.front(); ++n) settle_first(id, QueryOutcome::How::kUnanswered);
  info.query_code = own.pending.front().query_code;
  if (fits.size() == 1) {
    if (observed.at && own.pending.front().at)
      info.latency = *observed.at - *own.pending.front().at;
    if (sure && info.latency) own.slowest = std::max(own.slowest, *info.latency);
    settle_first(id, QueryOutcome::How::kAnswered, observed.at);
    return info;
  }
  if (own.equal_replies.empty()) own.run_frame = observed.frame;
  own.equal_replies.push_back(observed.at);
  if (own.equal_replies.size() == fits.size()) settle_run(id);
  return info;
}

/// Compares the age of `query` with the drive's latency so far, to judge a frame equal to `query`.
Conversation::Pace Conversation::pace_of(int id, const Pending& query,
                                         const std::optional<SimTime>& now) const {
  const SimTime slowest = drive(id).slowest;
  if (slowest == SimTime{0} || !now || !query.at || writes_rom(query.query)) return Pace::kAny;
  const SimTime age = *now - *query.at;
  if (age > kSlower * slowest + kSlowerBy) return Pace::kTooLate;
  return age <= 2 * slowest ? Pace::kAsEver : Pace::kAny;
}

/// Classifies a frame as a query that is sent again, so pending queries up to index `last` were not
/// answered.
FrameInfo Conversation::repeat_query(int id, const BusFrame& observed, std::size_t last) {
  settle_run(id);
  auto& pending = drive(id).pending;
  last = std::min(last + 1, pending.size());
  for (std::size_t n = 0; n < last; ++n) settle_first(id, QueryOutcome::How::kUnanswered);
  drive(id).alive = false;
  return query(id, observed, false);
}

FrameInfo Conversation::unclear(int id, const BusFrame& observed) {
  Drive& own = drive(id);
  const auto fits = fitting(id, observed.frame);
  const auto open = std::ranges::find_if(
      fits, [&own](std::size_t place) { return !own.pending[place].maybe_answered; });
  FrameInfo info = info_of(Role::kUnclear, id, observed.frame, false);
  if (open != fits.end()) {
    Pending& query = own.pending[*open];
    query.maybe_answered = true;
    if (observed.at && query.at) info.latency = *observed.at - *query.at;
  } else {
    ask(id, observed, true);
  }
  return info;
}

FrameInfo Conversation::query(int id, const BusFrame& observed, bool sure) {
  drive(id).is_complete = true;
  drive(id).seen = true;
  ask(id, observed, false);
  return info_of(Role::kQuery, id, observed.frame, sure);
}

void Conversation::ask(int id, const BusFrame& observed, bool unclear) {
  settle_run(id);
  const ReplyReader& reader = reader_of(id, observed.frame);
  const auto decoded = protocol::decode_query(observed.frame, reader.format);
  const auto* known = std::get_if<protocol::Query>(&decoded);
  if (known == nullptr) return;  // drives do not answer it
  const auto command = protocol::reply_command(known->command);
  if (!command) return;
  add(id, {.query = observed.frame,
           .command = *command,
           .query_code = observed.frame.data[0],
           .at = observed.at,
           .unclear = unclear});
}

void Conversation::add(int id, const Pending& query) {
  if (drive(id).pending.size() >= kMaxPending) settle_first(id, QueryOutcome::How::kUnanswered);
  drive(id).pending.push_back(query);
}

/// Returns indices in `pending` of the queries that the frame can answer.
std::vector<std::size_t> Conversation::fitting(int id, const Frame& frame) const {
  const ReplyReader& reader = reader_of(id, frame);
  std::vector<std::size_t> places;
  const auto& pending = drive(id).pending;
  for (std::size_t n = 0; n < pending.size(); ++n) {
    if (reply_fit(reader, pending[n].command, pending[n].query, frame) != Fit::kNo) {
      places.push_back(n);
    }
  }
  return places;
}

/// Settles pending queries that are older than kLongestReply as unanswered. The outcome of queries
/// that are later than `now` (time ran backwards) stays open.
void Conversation::expire(int id, const std::optional<SimTime>& now) {
  if (!now) return;
  const auto& pending = drive(id).pending;
  const auto over = [&now](const Pending& one) {
    return one.at && (*now - *one.at > kLongestReply || *now < *one.at);
  };
  if (pending.empty() || !over(pending.front())) return;
  settle_run(id);
  while (!pending.empty() && over(pending.front())) {
    const bool missed = *now > *pending.front().at;
    drive(id).alive = drive(id).alive && !(missed && pending.front().required);
    settle_first(id, missed ? QueryOutcome::How::kUnanswered : QueryOutcome::How::kOpen);
  }
}

/// Assigns a run of equal replies: n replies answer the last n of the matching queries.
void Conversation::settle_run(int id) {
  Drive& own = drive(id);
  const auto replies = std::exchange(own.equal_replies, {});
  if (replies.empty()) return;
  std::size_t candidates = fitting(id, own.run_frame).size();
  for (std::size_t answered = 0; answered < replies.size() && !own.pending.empty();) {
    const Pending& first = own.pending.front();
    const bool fits = reply_fit(reader_of(id, own.run_frame), first.command, first.query,
                                own.run_frame) != Fit::kNo;
    if (fits && candidates <= replies.size() - answered) {
      settle_first(id, QueryOutcome::How::kAnswered, replies[answered++]);
    } else {
      settle_first(id, QueryOutcome::How::kUnanswered);
    }
    if (fits) --candidates;
  }
}

void Conversation::settle_first(int id, QueryOutcome::How how,
                                const std::optional<SimTime>& replied_at) {
  const Pending first = drive(id).pending.front();
  drive(id).pending.pop_front();
  const bool answered = how == QueryOutcome::How::kAnswered;
  if (!answered && (!first.required || first.unclear)) return;
  QueryOutcome settled{.how = !answered && first.maybe_answered ? QueryOutcome::How::kOpen : how,
                       .drive = id,
                       .query_code = first.query_code,
                       .query = first.query,
                       .at = first.at,
                       .was_unclear = first.unclear};
  if (replied_at && first.at) settled.latency = *replied_at - *first.at;
  settled_.push_back(settled);
}

void Conversation::forget_times() {
  for (Drive& own : drives_) {
    for (Pending& one : own.pending) one.at.reset();
    for (auto& at : own.equal_replies) at.reset();
  }
}

void Conversation::end() {
  for (int id = protocol::kMinId; id <= protocol::kMaxId; ++id) {
    settle_run(id);
    while (!drive(id).pending.empty()) settle_first(id, QueryOutcome::How::kOpen);
  }
}

std::vector<QueryOutcome> Conversation::take_outcomes() { return std::exchange(settled_, {}); }

}  // namespace lk::emulator
