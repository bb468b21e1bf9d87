#include "emulator/monitor/record/log_compare.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "emulator/core/bus/bus.hpp"
#include "emulator/monitor/frames/log_pairing.hpp"

namespace lk::emulator {
namespace {

/// Converts a time of the log to a time of the bus.
SimTime simulated(SimTime at, SimTime first) { return at - first + kBeforeLog; }

/// Sends the frames to a bus and returns its replies in order.
std::vector<TimedFrame> emulate(const std::vector<TimedFrame>& sent, SimTime first,
                                const BusConfig& config) {
  Bus bus(config);
  std::vector<TimedFrame> replies;
  for (const TimedFrame& frame : sent) {
    const SimTime at = std::max(simulated(frame.at, first), bus.time());
    bus.deliver_to(at);
    bus.receive({at, frame.frame});
  }
  bus.deliver_to(bus.time() + kLongestReply);
  bus.take_replies(replies);
  return replies;
}

/// Returns the emulator's reply to each exchange. Assumes that each drive answers in order, and
/// answers a command either always or never.
std::vector<std::optional<TimedFrame>> assign(const PairedLog& log, SimTime first,
                                              const std::vector<TimedFrame>& replies,
                                              const std::map<int, ReplyReader>& readers) {
  std::vector<std::optional<TimedFrame>> answers(log.exchanges.size());
  std::map<int, std::vector<std::size_t>> asked;  // by drive: indices of exchanges
  for (std::size_t n = 0; n < log.exchanges.size(); ++n) asked[log.exchanges[n].id].push_back(n);
  std::map<int, std::size_t> next;
  for (const TimedFrame& reply : replies) {
    for (const auto& [id, reader] : readers) {
      if (reply.frame.id != reader.format.dialect.reply_id_base + static_cast<std::uint32_t>(id)) {
        continue;
      }
      const auto& own = asked[id];
      for (std::size_t n = next[id]; n < own.size(); ++n) {
        const Exchange& exchange = log.exchanges[own[n]];
        if (simulated(log.sent[exchange.query].at, first) > reply.at) break;
        if (!reader.answers_with(exchange.command, reply.frame.data[0])) continue;
        answers[own[n]] = reply;
        next[id] = n + 1;
        break;
      }
    }
  }
  return answers;
}

Latency latency(std::vector<SimTime> all) {
  if (all.empty()) return {};
  std::ranges::sort(all);
  return {all[all.size() / 2], all.back()};
}

/// Sums over the exchanges of one command.
struct Account {
  ComparedCommand command;
  std::vector<ComparedValue> values;
  std::vector<SimTime> in_log;  // latencies
  std::vector<SimTime> emulated;
};

void compare_values(Account& account, const TimedFrame& in_log, const TimedFrame& emulated,
                    const ReplyReader& reader) {
  protocol::Frame as_own = in_log.frame;  // the log's drive may use other identifiers
  as_own.id = emulated.frame.id;
  const auto theirs = reader.values(as_own);
  const auto ours = reader.values(emulated.frame);
  if (theirs.size() != ours.size()) {
    ++account.command.undecodable;
    return;
  }
  for (std::size_t n = 0; n < ours.size(); ++n) {
    auto place = std::ranges::find(account.values, ours[n].name, &ComparedValue::name);
    if (place == account.values.end()) {
      place = account.values.insert(place, {account.command.command, ours[n].name});
    }
    const double difference = std::abs(value_difference(theirs[n], ours[n]));
    ++place->count;
    if (difference == 0) ++place->equal;
    place->sum += difference;
    if (difference <= place->most) continue;
    place->most = difference;
    place->most_at = in_log.at;
    place->most_id = reader.id;
  }
}

double in_ms(SimTime time) { return std::chrono::duration<double, std::milli>(time).count(); }

}  // namespace

LogComparison compare_log(const std::vector<LoggedFrame>& log, const BusConfig& bus) {
  const PairedLog paired = pair_log(log, bus);
  LogComparison out{.framing = bus.serial ? protocol::Framing::kSerial : protocol::Framing::kCan,
                    .sent = paired.sent.size(),
                    .ambiguous = paired.ambiguous,
                    .orphans = paired.orphans,
                    .unknown_drive_frames = paired.unknown_drive_frames};
  if (paired.sent.empty()) return out;
  std::map<int, ReplyReader> readers;
  for (const ServoConfig& servo : bus.servos) readers.emplace(ReplyReader(servo).id, servo);
  const SimTime first = paired.sent.front().at;
  const auto answers = assign(paired, first, emulate(paired.sent, first, bus), readers);
  std::map<std::uint8_t, Account> accounts;
  for (std::size_t n = 0; n < answers.size(); ++n) {
    const auto& [id, query, byte, in_log] = paired.exchanges[n];
    const auto& emulated = answers[n];
    const SimTime asked_at = paired.sent[query].at;
    Account& account = accounts[byte];
    ComparedCommand& command = account.command;
    command.command = byte;
    ++command.queries;
    if (in_log) account.in_log.push_back(in_log->at - asked_at);
    if (emulated) account.emulated.push_back(emulated->at - simulated(asked_at, first));
    command.missing += in_log && !emulated ? 1U : 0U;
    command.extra += emulated && !in_log ? 1U : 0U;
    if (in_log && emulated) compare_values(account, *in_log, *emulated, readers.at(id));
  }
  for (auto& [byte, account] : accounts) {
    account.command.in_log = account.in_log.size();
    account.command.emulated = account.emulated.size();
    account.command.latency_in_log = latency(std::move(account.in_log));
    account.command.latency_emulated = latency(std::move(account.emulated));
    out.commands.push_back(account.command);
    out.values.insert(out.values.end(), account.values.begin(), account.values.end());
  }
  return out;
}

std::string comparison_text(const LogComparison& comparison) {
  std::string text =
      fmt::format("{} frame{} sent", comparison.sent, comparison.sent == 1 ? "" : "s");
  const auto note = [&text](std::uint64_t count, const char* what) {
    if (count > 0) text += fmt::format(", {} {}", count, what);
  };
  note(comparison.ambiguous, "that could be query or reply");
  note(comparison.orphans, "replies to nothing in the log");
  note(comparison.unknown_drive_frames, "of drives that the robot does not have, left out");
  text +=
      "\n\n| command | queries | replies: log | emulator | missing | extra | latency ms, median "
      "(max): log | emulator |\n|---|---|---|---|---|---|---|---|\n";
  for (const ComparedCommand& one : comparison.commands) {
    const auto latency_text = [](const Latency& of) {
      return fmt::format("{:.3f} ({:.3f})", in_ms(of.median), in_ms(of.most));
    };
    const auto* row = protocol::find_command(one.command, comparison.framing);
    text += fmt::format("| {:02X} {} | {} | {} | {} | {} | {} | {} | {} |\n", one.command,
                        row != nullptr ? row->name : "", one.queries, one.in_log, one.emulated,
                        one.missing, one.extra, latency_text(one.latency_in_log),
                        latency_text(one.latency_emulated));
    if (one.undecodable > 0) {
      text += fmt::format("| | | {} not to be read | | | | | |\n", one.undecodable);
    }
  }
  text +=
      "\n| command | quantity | compared | equal | mean difference | most | where |\n"
      "|---|---|---|---|---|---|---|\n";
  for (const ComparedValue& one : comparison.values) {
    const std::string where =
        one.most > 0 ? fmt::format("drive {} at {:.6f} s", one.most_id, in_seconds(one.most_at))
                     : "";
    text += fmt::format("| {:02X} | {} | {} | {} | {:.4g} | {:.4g} | {} |\n", one.command, one.name,
                        one.count, one.equal, one.mean(), one.most, where);
  }
  return text;
}

}  // namespace lk::emulator
