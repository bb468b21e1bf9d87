#include "emulator/monitor/frames/log_pairing.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <deque>
#include <iterator>
#include <map>
#include <numeric>
#include <utility>
#include <variant>

#include "emulator/core/servo/shaft_angles.hpp"
#include "emulator/core/servo/stored_settings.hpp"
#include "emulator/core/text.hpp"
#include "protocol/codec.hpp"
#include "protocol/field_values.hpp"

namespace lk::emulator {
namespace {

double bytes(const protocol::Payload& data, std::size_t first, std::size_t last) {
  std::uint64_t number = 0;
  for (std::size_t n = last + 1; n-- > first;) number = number << 8U | data[n];
  return static_cast<double>(number);
}

}  // namespace

ReplyReader::ReplyReader(const ServoConfig& servo)
    : id(drive_address(servo.rom, servo).id),
      format(protocol::wire_format(servo.quirks.dialect, servo.profile.series)),
      manual_reply_bytes(servo.quirks.manual_reply_bytes) {
  const ShaftAngles angles(servo.profile, servo.quirks);
  encoder_counts = static_cast<double>(angles.max_wire_count()) + 1;
  circle_deg = static_cast<double>(angles.circle_cdeg()) / 100;
}

std::vector<ReplyValue> ReplyReader::values(std::span<const protocol::Field> fields,
                                            const protocol::Payload& data, By by) const {
  std::vector<ReplyValue> values;
  for (const protocol::Field& field : fields) {
    if (!protocol::present(field, data, format)) continue;
    std::int64_t raw = protocol::raw(field, data);
    if (by == By::kHost) raw = protocol::taken(field, raw, format);
    if (field.zero_means_absent && raw == 0) continue;
    const double period = field.period == protocol::Period::kEncoder  ? encoder_counts
                          : field.period == protocol::Period::kCircle ? circle_deg
                                                                      : 0;
    values.push_back({field.key, protocol::quantity(field, raw, format), period});
  }
  return values;
}

std::vector<ReplyValue> ReplyReader::values(const protocol::Frame& frame) const {
  const auto decoded = protocol::decode_reply(frame, format);
  const auto* reply = std::get_if<protocol::ReplyFrame>(&decoded);
  if (reply == nullptr || reply->id != id) return {};
  const auto* const command = protocol::command_of(frame);
  if (!command->echoed) return values(command->reply, frame.data, By::kDrive);
  // In two parts, so that each is exact in a double.
  return {{"DATA[1..4]", bytes(frame.data, 1, 4)}, {"DATA[5..7]", bytes(frame.data, 5, 7)}};
}

bool ReplyReader::answers_with(std::uint8_t asked, std::uint8_t reply_command) const {
  if (asked == reply_command) return true;
  const auto* const command = protocol::find_command(asked, format.dialect.framing);
  return manual_reply_bytes && command != nullptr && reply_command != 0 &&
         static_cast<std::uint8_t>(command->printed) == reply_command;
}

double value_difference(const ReplyValue& a, const ReplyValue& b) {
  const double difference = b.value - a.value;
  return a.period > 0 ? std::remainder(difference, a.period) : difference;
}

std::string values_text(const std::vector<ReplyValue>& values) {
  std::vector<std::string> texts;
  for (const ReplyValue& one : values) {
    char buffer[32];
    const auto end = std::to_chars(buffer, std::end(buffer), one.value).ptr;
    texts.push_back(std::string(one.name) + " " + std::string(buffer, end));
  }
  return comma_list(texts);
}

namespace {

/// Returns true if the reply repeats the parameter or setting number of the query, if it has one.
bool is_about_the_same(const protocol::Frame& query, const protocol::Frame& reply,
                       const protocol::WireFormat& format) {
  const protocol::CommandInfo* const command = protocol::command_of(query);
  if (command == nullptr || protocol::find_multi_drive(query.id) != nullptr) return true;
  const auto differs = [&](const protocol::Field& field) {
    return protocol::repeats_in_reply(*command, field) &&
           protocol::present(field, query.data, format) &&
           query.data[field.byte] != reply.data[field.byte];
  };
  return std::ranges::none_of(command->query, differs);
}

/// Returns true if replies to this query look like queries.
bool is_ambiguous_reply(const protocol::Frame& query) {
  const protocol::CommandInfo* const command = protocol::command_of(query);
  return command != nullptr && protocol::looks_like_query(*command);
}

}  // namespace

Fit reply_fit(const ReplyReader& reader, std::uint8_t command, const protocol::Frame& query,
              const protocol::Frame& reply) {
  if (!reader.answers_with(command, reply.data[0])) return Fit::kNo;
  if (!has_length_of_reply(reply)) return Fit::kNo;
  if (!is_about_the_same(query, reply, reader.format)) return Fit::kNo;
  protocol::Frame own = reply;
  own.id = reader.format.dialect.reply_id_base + static_cast<std::uint32_t>(reader.id);
  const auto decoded = protocol::decode_reply(own, reader.format);
  const auto* content = std::get_if<protocol::ReplyFrame>(&decoded);
  if (content == nullptr) return Fit::kNo;
  const bool same = reply.data == query.data && reply.dlc == query.dlc;
  if (std::holds_alternative<protocol::Echo>(content->reply)) {
    return same ? Fit::kEither : Fit::kNo;
  }
  if (is_serial(reply)) return same ? Fit::kEither : Fit::kYes;  // query and reply differ in length
  const bool state = protocol::has_state(reply.data[0]);
  // A state at 0 or 1 °C counts as a query, which has 0 or a direction (0 or 1) in DATA[1].
  if (state) return same || reply.data[1] <= 1 ? Fit::kNo : Fit::kYes;
  return same || is_ambiguous_reply(query) ? Fit::kEither : Fit::kYes;
}

bool looks_like_a_state(const protocol::Frame& frame) {
  if (!protocol::has_state(frame.data[0])) return false;
  return is_serial(frame) ? frame.dlc == protocol::kCanBytes : frame.data[1] > 1;
}

bool has_length_of_reply(const protocol::Frame& frame) {
  const protocol::CommandInfo* const command = protocol::command_of(frame);
  if (!protocol::is_serial(frame) || command == nullptr) return true;
  constexpr protocol::Opcode kBlockReads[] = {
      protocol::ReadProduct::kOpcode, protocol::ReadSettingsBlock::kOpcode,
      protocol::ReadCalibration::kOpcode, protocol::AlignReducer::kOpcode};
  const bool reads = std::ranges::find(kBlockReads, command->opcode) != std::end(kBlockReads);
  const bool writes = command->query_len != nullptr;
  const bool empty = frame.dlc == 1;
  return !(reads && empty) && !(writes && !empty);
}

bool is_data(const protocol::Frame& frame) {
  if (frame.kind == protocol::FrameKind::kSerial) return frame.dlc > 0;
  return frame.kind == protocol::FrameKind::kData && !frame.extended && frame.dlc == 8;
}

namespace {

using protocol::Frame;

/// Returns the drive of a frame with the identifier of queries, which most replies share; 0: none.
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

  /// Marks which of the drive's frames are queries, and assigns the replies to them.
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
    if (!std::holds_alternative<protocol::Query>(query)) return;  // the drive does not answer it
    const bool single = drive_of(frame(place)) != 0;
    if (single == several_) return;
    const auto own = protocol::for_drive(id(), std::get<protocol::Query>(query), reader_.format);
    if (!std::holds_alternative<protocol::Query>(own)) return;
    if (const auto command = protocol::reply_command(std::get<protocol::Query>(own).command)) {
      pending_.push_back(exchanges.size());
      exchanges.push_back({id(), place, *command, std::nullopt});
    }
  }

  /// Returns the index in `pending_` of the query that frame `n` answers. `surely`: the frame is
  /// known to be a reply. If several queries match, the first ones got no reply: a run of n replies
  /// answers the last n of the matching queries.
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
  std::vector<std::size_t> own_;     // indices in the log of frames of or for this drive
  std::deque<std::size_t> pending_;  // indices in `exchanges`
  bool own_replies_ = false;
  bool directions_count_ = false;
};

/// Returns true if the directions show the roles. They are relative to the logging machine, and
/// thus useful only if both occur.
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
      drive != drives.end() ? drive->second.add(n) : void(++out.unknown_drive_frames);
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
