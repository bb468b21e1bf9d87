#include "emulator/frames/log_pairing.hpp"

#include <algorithm>
#include <cstdlib>
#include <deque>
#include <map>
#include <numeric>
#include <utility>
#include <variant>

#include "emulator/frames/reply_fit.hpp"
#include "protocol/codec.hpp"

namespace lk::emulator {
namespace {

using protocol::Frame;

/// Returns the drive of a frame with the identifier of queries and most replies; 0: none.
int drive_of(const Frame& frame) {
  return is_data(frame) ? protocol::drive_at(frame.id, protocol::kSingleDriveId) : 0;
}
/// Returns the drive of a frame with a separate reply identifier; 0: none.
int own_reply_of(const Frame& frame) {
  return is_data(frame) && !protocol::is_serial(frame) ? protocol::drive_at_own(frame.id) : 0;
}

/// One drive and its frames in the log.
class Drive {
 public:
  Drive(const ServoConfig& servo, const std::vector<LoggedFrame>& log)
      : reader_(servo), several_(servo.rom.broadcast_mode), log_(&log) {}

  int id() const { return reader_.id; }
  void add(std::size_t place) { own_.push_back(place); }

  /// Marks which of its frames are queries, and pairs the replies.
  void pair(std::vector<bool>& is_query, PairedLog& out, bool directions_count) {
    directions_count_ = directions_count;
    own_replies_ = std::ranges::any_of(
        own_, [this](std::size_t place) { return own_reply_of(frame(place)) != 0; });
    for (std::size_t n = 0; n < own_.size(); ++n) take(n, is_query, out);
  }
  std::vector<Exchange> exchanges;  // `query` is an index into the log

 private:
  const Frame& frame(std::size_t place) const { return (*log_)[place].timed.frame; }
  SimTime at(std::size_t place) const { return (*log_)[place].timed.at; }

  void take(std::size_t n, std::vector<bool>& is_query, PairedLog& out) {
    const std::size_t place = own_[n];
    while (!pending_.empty() && at(place) - at(exchanges[pending_.front()].query) > kLongestReply) {
      pending_.pop_front();
    }
    const auto sure = surely_from_host(place);
    // NOLINTNEXTLINE(bugprone-branch-clone): said to be a query, or left over
    if (sure == true) {
      ask(place, is_query);
    } else if (const auto match = likely_answer(n, sure.has_value(), out)) {
      exchanges[pending_[*match]].reply = (*log_)[place].timed;
      pending_.erase(pending_.begin(), pending_.begin() + static_cast<std::ptrdiff_t>(*match) + 1);
    } else if (sure || looks_like_a_state(frame(place))) {
      ++out.orphans;
      if (!sure) ++out.ambiguous;
    } else {
      ask(place, is_query);
    }
  }

  std::optional<bool> surely_from_host(std::size_t place) const {
    if (drive_of(frame(place)) == 0) {
      return own_reply_of(frame(place)) == 0;
    }
    if (own_replies_) return true;
    return directions_count_ ? (*log_)[place].from_host : std::nullopt;
  }

  void ask(std::size_t place, std::vector<bool>& is_query) {
    is_query[place] = true;
    const auto query = protocol::decode_query(frame(place), reader_.format);
    if (!std::holds_alternative<protocol::Query>(query)) return;  // not answered
    const bool single = drive_of(frame(place)) != 0;
    if (single == several_) return;
    const auto own = protocol::for_drive(id(), std::get<protocol::Query>(query), reader_.format);
    if (!std::holds_alternative<protocol::Query>(own)) return;
    if (const auto command = protocol::reply_command(std::get<protocol::Query>(own).command)) {
      pending_.push_back(exchanges.size());
      exchanges.push_back({id(), place, *command, std::nullopt});
    }
  }

  /// Returns the index in `pending_` of the query that the frame answers; `surely`: it is a reply.
  /// If several match, the first ones got no reply: a run of n replies answers the last n of the
  /// matching queries.
  std::optional<std::size_t> likely_answer(std::size_t n, bool surely, PairedLog& out) const {
    const std::size_t place = own_[n];
    std::vector<std::size_t> can;
    for (std::size_t k = 0; k < pending_.size(); ++k) {
      if (fit(exchanges[pending_[k]], frame(place)) != Fit::kNo) can.push_back(k);
    }
    if (can.empty()) return std::nullopt;
    const Exchange& last = exchanges[pending_[can.back()]];
    const bool either = can.size() > 1 || fit(last, frame(place)) == Fit::kEither;
    if (!surely && either) ++out.ambiguous;
    std::size_t replies = 1;
    for (std::size_t next = n + 1; next < own_.size() && replies < can.size(); ++next) {
      if (surely_from_host(own_[next]) == true) break;
      const Fit fits = fit(last, frame(own_[next]));
      if (fits == Fit::kYes || (surely && fits == Fit::kEither)) {
        ++replies;
      } else if (!surely) {
        break;
      }
    }
    return can[can.size() - replies];
  }

  Fit fit(const Exchange& asked, const Frame& reply) const {
    return reply_fit(reader_, asked.command, frame(asked.query), reply);
  }

  ReplyReader reader_;
  bool several_;  // answers only commands for several drives
  const std::vector<LoggedFrame>* log_;
  std::vector<std::size_t> own_;     // indices of its frames in the log
  std::deque<std::size_t> pending_;  // indices in `exchanges`
  bool own_replies_ = false;
  bool directions_count_ = false;
};

/// Directions are relative to the logging machine; they are useful only if both occur.
bool directions_tell(const std::vector<LoggedFrame>& log) {
  const auto any = [&log](bool from_host) {
    return std::ranges::any_of(log, [from_host](const LoggedFrame& one) {
      return one.from_host == from_host && drive_of(one.timed.frame) != 0;
    });
  };
  return any(true) && any(false);
}

}  // namespace

PairedLog pair_log(const std::vector<LoggedFrame>& log, const BusConfig& bus) {
  std::map<int, Drive> drives;
  for (const ServoConfig& servo : bus.servos) {
    Drive drive(servo, log);
    const int id = drive.id();
    drives.emplace(id, std::move(drive));
  }
  PairedLog out;
  std::vector<bool> is_query(log.size(), false);
  for (std::size_t n = 0; n < log.size(); ++n) {
    const Frame& frame = log[n].timed.frame;
    const int single = drive_of(frame) + own_reply_of(frame);
    if (single != 0) {
      const auto drive = drives.find(single);
      drive != drives.end() ? drive->second.add(n) : void(++out.strangers);
    } else if (is_data(frame) && protocol::find_multi_drive(frame.id) != nullptr) {
      is_query[n] = true;
      for (auto& [id, drive] : drives) drive.add(n);
    } else {
      is_query[n] = frame.kind != protocol::FrameKind::kError;
    }
  }
  const bool directions_count = directions_tell(log);
  for (auto& [id, drive] : drives) {
    drive.pair(is_query, out, directions_count);
    out.exchanges.insert(out.exchanges.end(), drive.exchanges.begin(), drive.exchanges.end());
  }
  // Converts indices in the log to indices in `sent`.
  std::vector<std::size_t> sent_before(log.size() + 1, 0);
  for (std::size_t n = 0; n < log.size(); ++n) {
    sent_before[n + 1] = sent_before[n] + (is_query[n] ? 1 : 0);
    if (is_query[n]) out.sent.push_back(log[n].timed);
  }
  for (Exchange& exchange : out.exchanges) exchange.query = sent_before[exchange.query];
  std::ranges::stable_sort(out.exchanges, {}, &Exchange::query);
  return out;
}

}  // namespace lk::emulator
