#include "emulator/core/scenario/judge.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "emulator/core/scenario/scenario_text.hpp"
#include "protocol/codec.hpp"

namespace lk::emulator {
namespace {

using Status = ExpectationResult::Status;
using Kind = Period::Kind;

/// Returns the sampled quantity: the signal; 1 for an error that is set; the run state.
double read(const Expectation& expectation, const DriveView& drive) {
  if (const auto* within = std::get_if<SignalWithin>(&expectation.what)) {
    return within->signal->read(drive);
  }
  if (const auto* error = std::get_if<ErrorIs>(&expectation.what)) {
    return error->error.in(drive.telemetry.errors) ? 1 : 0;
  }
  // A drive without power has no state.
  return drive.telemetry.alive ? static_cast<double>(drive.servo.run_state_at(drive.telemetry))
                               : std::numeric_limits<double>::quiet_NaN();
}

Range wanted(const Expectation& expectation) {
  if (const auto* within = std::get_if<SignalWithin>(&expectation.what)) return within->range;
  const auto* error = std::get_if<ErrorIs>(&expectation.what);
  const double one = error != nullptr
                         ? (error->set ? 1.0 : 0.0)
                         : static_cast<double>(std::get<StateIs>(expectation.what).state);
  return {one, one};
}

/// NaN and infinite values are outside of every range.
bool is_within(const Range& range, double value) {
  return std::isfinite(value) && range.has(value);
}

double distance(const Range& range, double value) {
  if (!std::isfinite(value)) return std::numeric_limits<double>::infinity();
  return std::max({range.min - value, value - range.max, 0.0});
}

/// Returns true if frames decide the expectation, not samples.
bool counts_frames(const Expectation& expectation) {
  return std::holds_alternative<Replies>(expectation.what) ||
         std::holds_alternative<Answered>(expectation.what);
}

/// Distance of `value` from the nearest bound, in widths of the range; below 0 outside.
double margin_in(const Range& range, double value) {
  const bool has_min = std::isfinite(range.min);
  const bool has_max = std::isfinite(range.max);
  double width = range.max - range.min;
  if (!has_min || !has_max) width = std::abs(has_min ? range.min : range.max);
  if (width <= 0) width = 1;
  return std::min(value - range.min, range.max - value) / width;
}

bool can_be_of_a_drive(const protocol::Frame& frame) {
  return (frame.kind == protocol::FrameKind::kData && !frame.extended) ||
         frame.kind == protocol::FrameKind::kSerial;
}

bool has_most(const Replies& replies) {
  return replies.max_count != std::numeric_limits<std::uint64_t>::max();
}

/// Returns the command for the drive `id` in a multi-drive frame; nullopt if there is none.
std::optional<std::uint8_t> command_for(int id, const protocol::Frame& frame,
                                        const protocol::WireFormat& format) {
  const auto decoded = protocol::decode_query(frame, format);
  const auto* query = std::get_if<protocol::Query>(&decoded);
  if (query == nullptr) return std::nullopt;
  if (const auto* any = std::get_if<protocol::MultiCommand>(&query->command)) {
    const auto slot = static_cast<std::size_t>(id - protocol::kMinId);
    return slot < any->opcodes.size() ? std::optional(any->opcodes[slot]) : std::nullopt;
  }
  return protocol::reply_command(query->command);
}

}  // namespace

const char* status_word(ExpectationResult::Status status) {
  switch (status) {
    case Status::kPassed:
      return "passed";
    case Status::kFailed:
      return "failed";
    case Status::kOpen:
      break;
  }
  return "open";
}

Judge::Judge(const BusConfig& config, const std::vector<Expectation>& expectations, std::size_t bus,
             SimTime start)
    : interface_(config.interface), start_(start) {
  for (const ServoConfig& servo : config.servos) {
    const protocol::Dialect& dialect = servo.quirks.dialect;
    drives_.push_back({servo.id, dialect.reply_id_base + static_cast<std::uint32_t>(servo.id),
                       protocol::wire_format(dialect, servo.profile.series)});
  }
  for (const Expectation& expectation : expectations) {
    if (expectation.bus != bus) continue;
    Trial trial;
    trial.expectation = expectation;
    if (!counts_frames(expectation)) {
      const Period& when = expectation.when;
      trial.next = start + (when.kind == Kind::kAt ? when.to : when.from);
      next_due_ = std::min(next_due_, trial.next);
    }
    trials_.push_back(std::move(trial));
  }
}

void Judge::sample(const Bus& bus) {
  const SimTime now = bus.time();
  next_due_ = SimTime::max();
  for (Trial& trial : trials_) {
    if (trial.next <= now) sample_trial(trial, bus.view(trial.expectation.id), now);
    next_due_ = std::min(next_due_, trial.next);
  }
}

void Judge::sample_trial(Trial& trial, const DriveView& drive, SimTime now) {
  const Period& when = trial.expectation.when;
  const Range range = wanted(trial.expectation);
  const double value = read(trial.expectation, drive);
  const bool holds = is_within(range, value);
  const bool last = now >= start_ + when.to;
  if (!trial.value || holds || distance(range, value) < distance(range, *trial.value) ||
      when.kind == Kind::kThroughout) {
    trial.value = value;
    trial.at = now - start_;
  }
  const Range seen = trial.seen.value_or(Range{value, value});
  trial.seen = Range{std::min(seen.min, value), std::max(seen.max, value)};
  const bool decides_early = when.kind == Kind::kBy ? holds : !holds;
  if (decides_early || last) {
    trial.status = holds ? Status::kPassed : Status::kFailed;
    trial.decided_at = now - start_;
    trial.next = SimTime::max();
  } else {
    trial.next = std::min(now + kStep, start_ + when.to);
  }
}

void Judge::on_query(const TimedFrame& query, const Bus& bus) {
  if (!can_be_of_a_drive(query.frame) || query.frame.dlc == 0) return;
  const bool for_several = protocol::find_multi_drive(query.frame.id) != nullptr;
  for (ReplyingDrive& drive : drives_) {
    if (bus.state().nodes.of(drive.id).servo.multi_drive_mode() != for_several) continue;
    std::optional<std::uint8_t> command;
    if (query.frame.id ==
        protocol::kSingleDriveId + static_cast<std::uint32_t>(bus.bus_address(drive.id).id)) {
      command = query.frame.data[0];
    } else if (for_several) {
      command = command_for(bus.bus_address(drive.id).id, query.frame, drive.format);
    }
    if (!command) continue;
    drive.asked[*command] = query.at;
    drive.asked_as = bus.bus_address(drive.id).id;
    for (Trial& trial : trials_) {
      const auto* answered = std::get_if<Answered>(&trial.expectation.what);
      const SimTime at = query.at - start_;
      if (answered == nullptr || trial.expectation.id != drive.id || trial.missed ||
          answered->command.value_or(*command) != *command || at < trial.expectation.when.from ||
          at > trial.expectation.when.to) {
        continue;
      }
      trial.asked.emplace(*command, at);  // keeps the time of an earlier unanswered query
    }
  }
}

void Judge::on_answer(Trial& trial, const TimedFrame& reply) const {
  const auto waiting = trial.asked.find(reply.frame.data[0]);
  if (waiting == trial.asked.end()) return;
  const SimTime limit = waiting->second + std::get<Answered>(trial.expectation.what).within;
  if (reply.at - start_ > limit) trial.missed = std::min(trial.missed.value_or(limit), limit);
  trial.asked.erase(waiting);
}

std::optional<SimTime> Judge::missed_by(const Trial& trial, SimTime now) {
  std::optional<SimTime> missed = trial.missed;
  const SimTime within = std::get<Answered>(trial.expectation.what).within;
  for (const auto& [command, at] : trial.asked) {
    const SimTime limit = at + within;
    if (limit <= now) missed = std::min(missed.value_or(limit), limit);
  }
  return missed;
}

void Judge::on_reply(const TimedFrame& reply) {
  if (reply.echo || !can_be_of_a_drive(reply.frame)) return;
  const auto drive = reply.drive_id != 0
                         ? std::ranges::find(drives_, reply.drive_id, &ReplyingDrive::id)
                         : std::ranges::find(drives_, reply.frame.id, &ReplyingDrive::reply_id);
  if (drive == drives_.end()) return;
  const auto decoded = protocol::decode_reply(reply.frame, drive->format);
  const auto* readable = std::get_if<protocol::ReplyFrame>(&decoded);
  // A host does not accept a damaged frame, or one with another ID or length, as the answer.
  const bool answers = readable != nullptr && readable->id == drive->asked_as;
  for (Trial& trial : trials_) {
    if (std::holds_alternative<Answered>(trial.expectation.what)) {
      if (trial.expectation.id == drive->id && answers) on_answer(trial, reply);
      continue;
    }
    const auto* replies = std::get_if<Replies>(&trial.expectation.what);
    const Period& when = trial.expectation.when;
    const SimTime at = reply.at - start_;
    if (replies == nullptr || trial.expectation.id != drive->id || at < when.from || at > when.to ||
        !matches(*replies, *drive, reply)) {
      continue;
    }
    if (trial.count++ == 0) trial.at = at;
    const bool enough = trial.count == replies->min_count && !has_most(*replies);
    if (enough || trial.count == replies->max_count + 1) trial.decided_at = at;
  }
}

bool Judge::matches(const Replies& replies, const ReplyingDrive& drive,
                    const TimedFrame& reply) const {
  const protocol::Frame& frame = reply.frame;
  if (replies.command && (frame.dlc == 0 || frame.data[0] != *replies.command)) return false;
  if (replies.age) {
    const auto asked = frame.dlc > 0 ? drive.asked[frame.data[0]] : std::nullopt;
    if (!asked) return false;
    const std::chrono::duration<double, std::milli> age = reply.at - *asked;
    if (!replies.age->has(age.count())) return false;
  }
  if (!replies.error && replies.field.empty()) return true;
  const auto decoded = protocol::decode_reply(frame, drive.format);
  if (std::holds_alternative<protocol::Reject>(decoded)) return false;
  const auto quantity = [&](std::string_view word) {
    return protocol::reply_quantity(word, frame.data, drive.format);
  };
  if (replies.error) {
    const auto errors = quantity("errors");
    if (!errors || !replies.error->in(static_cast<model::ErrorBits>(*errors))) return false;
  }
  if (!replies.field.empty()) {
    const auto value = quantity(replies.field);
    if (!value || !replies.range.has(*value)) return false;
  }
  return true;
}

std::vector<ExpectationResult> Judge::results(SimTime now) const {
  std::vector<ExpectationResult> results;
  for (const Trial& trial : trials_) results.push_back(result(trial, now));
  return results;
}

namespace {

void answer_result(std::optional<SimTime> missed, bool over, ExpectationResult& result) {
  if (missed) {
    result.status = Status::kFailed;
    result.at = result.decided_at = missed;
    result.measured = "no answer by " + time_text(*missed);
  } else if (over) {
    result.status = Status::kPassed;
    result.measured = "answered";
  }
}

}  // namespace

ExpectationResult Judge::result(const Trial& trial, SimTime now) const {
  const Expectation& expectation = trial.expectation;
  ExpectationResult result;
  result.decided_at = trial.decided_at;
  result.status = trial.status;
  result.expected = expectation_text(expectation, interface_);
  result.measured = measured(trial);
  result.description = expectation.description;
  if (std::holds_alternative<Answered>(expectation.what)) {
    answer_result(missed_by(trial, now - start_), now - start_ >= expectation.when.to, result);
    if (result.status == Status::kPassed) result.decided_at = expectation.when.to;
  } else if (const auto* replies = std::get_if<Replies>(&expectation.what)) {
    const bool over = now - start_ >= expectation.when.to;
    const bool enough = trial.count >= replies->min_count && (over || !has_most(*replies));
    if (trial.count > replies->max_count || (over && !enough)) {
      result.status = Status::kFailed;
    } else if (enough) {
      result.status = Status::kPassed;
    }
    if (trial.count > 0) result.at = trial.at;
    if (over && !result.decided_at) result.decided_at = expectation.when.to;
  } else if (trial.value) {
    result.at = trial.at;
  }
  result.margin = margin(trial);
  return result;
}

std::optional<double> Judge::margin(const Trial& trial) {
  const Period& when = trial.expectation.when;
  if (!trial.value || trial.status == Status::kOpen) return std::nullopt;
  if (when.kind == Kind::kBy && trial.status == Status::kPassed) {
    const auto whole = static_cast<double>((when.to - when.from).count());
    return whole > 0 ? static_cast<double>((when.to - trial.at).count()) / whole : 0;
  }
  const auto* within = std::get_if<SignalWithin>(&trial.expectation.what);
  if (within == nullptr || !std::isfinite(*trial.value)) return std::nullopt;
  if (when.kind != Kind::kThroughout) return margin_in(within->range, *trial.value);
  return std::min(margin_in(within->range, trial.seen->min),
                  margin_in(within->range, trial.seen->max));
}

std::string Judge::measured(const Trial& trial) const {
  const Expectation& expectation = trial.expectation;
  const std::string at = " at " + time_text(trial.at);
  if (std::holds_alternative<Replies>(expectation.what)) {
    if (trial.count == 0) return "no reply";
    return trial.count == 1 ? "1 reply" + at
                            : std::to_string(trial.count) + " replies, the first" + at;
  }
  if (!trial.value) return "not looked at yet";
  // A failed kBy expectation never held, so it has no time.
  const bool missed = expectation.when.kind == Kind::kBy && trial.status == Status::kFailed;
  const std::string until = " by " + time_text(expectation.when.to);
  if (const auto* error = std::get_if<ErrorIs>(&expectation.what)) {
    if (missed) return (error->set ? "never set" : "never without it") + until;
    const bool open = expectation.when.kind == Kind::kBy && trial.status == Status::kOpen;
    if (open) return error->set ? "not set so far" : "set so far";
    return (*trial.value != 0 ? "set" : "not set") + at;
  }
  if (const auto* wished = std::get_if<StateIs>(&expectation.what)) {
    const std::string state =
        std::isfinite(*trial.value) ? state_word(static_cast<RunState>(*trial.value)) : "no power";
    return (missed ? "never " + std::string(state_word(wished->state)) + until + ", " : "") +
           state + at;
  }
  if (expectation.when.kind == Kind::kThroughout && trial.status == Status::kPassed) {
    return number_text(trial.seen->min) + " to " + number_text(trial.seen->max);
  }
  return (missed ? "closest was " : "") + number_text(*trial.value) + at;
}

ErrorWatch::ErrorWatch(const BusConfig& config, SimTime start) : start_(start), next_due_(start) {
  for (const ServoConfig& servo : config.servos) drives_.push_back({servo.id});
}

void ErrorWatch::sample(const Bus& bus) {
  const SimTime now = bus.time();
  for (Watched& drive : drives_) {
    const model::ErrorBits set = bus.telemetry(drive.id).errors;
    if ((set & ~drive.seen) == 0) continue;
    for (int n = 0; n < model::kErrorKinds; ++n) {
      const auto error = static_cast<model::Error>(n);
      if ((set & ~drive.seen & model::bit(error)) != 0) {
        firsts_.push_back({drive.id, error, now - start_});
      }
    }
    drive.seen |= set;
  }
  next_due_ = now + Judge::kStep;
}

}  // namespace lk::emulator
