// Reads [[expect]]: expectations of a scenario, and when they must hold.

#include <algorithm>

#include "emulator/config/events/config_directives.hpp"
#include "emulator/config/scenario/config_scenario.hpp"
#include "emulator/config/scenario/config_send.hpp"

namespace lk::emulator {
namespace {

constexpr double kAnything = 1e12;
constexpr std::int64_t kMaxReplies = 1'000'000'000'000;

/// Reads min and max; nullopt if both are absent.
std::optional<Range> read_range(TableReader& reader, const char* min_key, const char* max_key) {
  const auto min = reader.number(min_key, -kAnything, kAnything);
  const auto max = reader.number(max_key, -kAnything, kAnything);
  if (!min && !max) return std::nullopt;
  if (min && max && *max < *min) reader.fail(max_key, std::string("is below ") + min_key);
  Range range;
  if (min) range.min = *min;
  if (max) range.max = *max;
  return range;
}

/// Reads `NAME = { from = A, to = B }`, where NAME is a signal of a drive.
std::optional<SignalWithin> read_named_signal(TableReader& reader) {
  for (const Signal& signal : signals()) {
    const std::string name(signal.name);
    if (!reader.has(name)) continue;
    auto limits = reader.table(name);
    const auto range = read_range(*limits, "from", "to");
    limits->finish();
    if (!range) reader.fail(name, "needs from, to or both");
    return SignalWithin{&signal, *range};
  }
  return std::nullopt;
}

std::string_view read_field(TableReader& reader) {
  std::vector<std::string> names;
  for (const std::string_view word : protocol::reply_words()) names.emplace_back(word);
  const auto place = reader.choice("field", names);
  return place ? protocol::reply_words()[*place] : std::string_view();
}

void read_counts(TableReader& reader, Replies& replies) {
  const auto count = reader.integer("count", 0, kMaxReplies);
  const auto min = reader.integer("min_count", 0, kMaxReplies);
  const auto max = reader.integer("max_count", 0, kMaxReplies);
  if (count && (min || max)) {
    reader.fail("count", "does not go together with min_count and max_count");
  }
  if (min && max && *max < *min) reader.fail("max_count", "is below min_count");
  if (count) {
    replies.min_count = replies.max_count = static_cast<std::uint64_t>(*count);
  }
  if (max) {
    replies.max_count = static_cast<std::uint64_t>(*max);
    replies.min_count = 0;
  }
  if (min) replies.min_count = static_cast<std::uint64_t>(*min);
}

/// Reads an error word, or "any".
std::optional<WhichError> read_which_error(TableReader& reader) {
  if (reader.is_text("error") && reader.text("error") == "any") return WhichError{};
  const auto error = read_error(reader, "error");
  if (!error) return std::nullopt;
  WhichError which;
  which.one = error;
  return which;
}

Replies read_replies(TableReader& reader, bool none) {
  Replies replies;
  if (none) replies.min_count = replies.max_count = 0;
  replies.command = read_command_or_word(reader, "command");
  replies.error = read_which_error(reader);
  replies.field = read_field(reader);
  const auto range = read_range(reader, "min", "max");
  replies.age = read_range(reader, "min_delay_ms", "max_delay_ms");
  if (!none) read_counts(reader, replies);
  reader.finish();
  if (range && replies.field.empty()) {
    reader.fail("field", "missing; min and max are limits of a field");
  }
  if (!range && !replies.field.empty()) reader.fail("field", "needs min, max or both");
  if (range) replies.range = *range;
  return replies;
}

Answered read_answered(TableReader& reader) {
  Answered answered;
  answered.command = read_command_or_word(reader, "command");
  answered.within = reader.required("within_s", read_duration(reader, "within_s"));
  reader.finish();
  return answered;
}

Period read_period(TableReader& reader, SimTime duration, bool counts) {
  const auto at = read_moment(reader, "at_s", duration);
  const auto by = read_moment(reader, "by_s", duration);
  const auto from = read_moment(reader, "from_s", duration);
  const auto to = read_moment(reader, "to_s", duration);
  if (at && (by || from || to)) {
    reader.fail("at_s", "does not go together with by_s, from_s and to_s");
  }
  if (by && to) reader.fail("by_s", "does not go together with to_s");
  if (to && !from) reader.fail("to_s", "needs from_s");
  if (at && counts) reader.fail("at_s", "replies take a while: use from_s and to_s, or by_s");
  Period period{Period::Kind::kAt, from.value_or(SimTime{0}), duration};
  if (at) {
    period.to = *at;
  } else if (by) {
    period.kind = Period::Kind::kBy;
    period.to = *by;
  } else if (from || counts) {
    period.kind = Period::Kind::kThroughout;
    period.to = to.value_or(duration);
  }
  if (period.to < period.from) reader.fail(by ? "by_s" : "to_s", "is before from_s");
  return period;
}

constexpr const char* kSubjects[] = {"signal", "error", "state", "reply", "no_reply", "answered"};

void check_subjects(TableReader& reader) {
  const char* first = nullptr;
  for (const char* subject : kSubjects) {
    if (!reader.has(subject)) continue;
    if (first != nullptr) {
      reader.fail(subject, std::string("only one of signal, error, state, reply, no_reply and "
                                       "answered; this expectation has ") +
                               first + " already");
    }
    first = subject;
  }
}

/// Rejects unknown keys first, so that a misspelt subject is reported as such; then keys that
/// belong to another subject.
void finish_expectation(TableReader& reader) {
  const bool odd_range = !reader.has("signal") && (reader.has("min") || reader.has("max"));
  const bool odd_set = !reader.has("error") && reader.has("set");
  if (odd_range) read_range(reader, "min", "max");
  if (odd_set) reader.boolean("set");
  reader.finish();
  if (odd_range) reader.fail(reader.has("min") ? "min" : "max", "belongs to signal");
  if (odd_set) reader.fail("set", "belongs to error");
}

}  // namespace

Expectation read_expectation(TableReader& reader, const Scenario& scenario) {
  Expectation expectation;
  check_subjects(reader);
  const auto id = reader.integer("id", protocol::kMinId, protocol::kMaxId);
  if (id) expectation.id = static_cast<int>(*id);
  expectation.description = reader.text("says").value_or("");
  bool found = true;
  bool of_body = false;
  if (const Signal* signal = read_signal(reader, "signal", scenario.robot.front())) {
    of_body = signal->is_of_body();
    if (of_body && id) reader.fail("id", "a body signal belongs to no drive; remove this key");
    const auto range = read_range(reader, "min", "max");
    if (!range) reader.fail("signal", "needs min, max or both");
    expectation.what = SignalWithin{signal, *range};
  } else if (const auto named = read_named_signal(reader)) {
    expectation.what = *named;
  } else if (const auto error = read_which_error(reader)) {
    expectation.what = ErrorIs{*error, reader.boolean("set").value_or(true)};
  } else if (const auto state = reader.choice("state", {"off", "stopped", "running"})) {
    expectation.what = StateIs{static_cast<RunState>(*state)};
  } else if (auto reply = reader.table("reply")) {
    expectation.what = read_replies(*reply, false);
  } else if (auto none = reader.table("no_reply")) {
    expectation.what = read_replies(*none, true);
  } else if (auto answered = reader.table("answered")) {
    expectation.what = read_answered(*answered);
  } else {
    found = false;
  }
  if (!id && !of_body) reader.note_missing("id");
  const bool counts = std::holds_alternative<Replies>(expectation.what) ||
                      std::holds_alternative<Answered>(expectation.what);
  expectation.when = read_period(reader, scenario.duration, counts);
  if (!id && !of_body) {
    reader.text("bus");
    finish_expectation(reader);
  }
  if (of_body) {
    if (reader.has("bus")) reader.fail("bus", "a body signal belongs to no bus; remove this key");
    expectation.id = scenario.robot.front().servos.front().id;  // any drive
  } else {
    expectation.bus = read_bus_of(reader, scenario.robot, expectation.id);
  }
  finish_expectation(reader);
  if (!found)
    reader.fail("id",
                "missing expectation: give signal, error, state, reply, no_reply or answered");
  check_id(reader, "id", scenario.robot[expectation.bus], expectation.id);
  return expectation;
}

}  // namespace lk::emulator
