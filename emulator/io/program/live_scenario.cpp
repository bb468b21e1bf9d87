#include "emulator/io/program/live_scenario.hpp"

#include <algorithm>
#include <iterator>
#include <stdexcept>
#include <string>
#include <utility>

#include "emulator/core/faults/fault_table.hpp"
#include "emulator/core/frame_text.hpp"
#include "emulator/core/scenario/scenario_text.hpp"
#include "emulator/io/control/control_api.hpp"

namespace lk::emulator {
namespace {

std::size_t faults_in(const std::vector<TimedDirective>& events) {
  return static_cast<std::size_t>(std::ranges::count_if(events, [](const TimedDirective& event) {
    return std::holds_alternative<SetFault>(event.directive.what);
  }));
}

}  // namespace

void check_room(const Scenario& scenario, const std::vector<Line*>& lines) {
  for (std::size_t n = 0; n < lines.size(); ++n) {
    const std::size_t there = lines[n]->bus().state().faults.unfinished();
    if (there + faults_in(scenario.robot[n].events) <= Bus::kMaxFaults) continue;
    throw std::invalid_argument(lines[n]->name() + ": a bus holds at most " +
                                std::to_string(Bus::kMaxFaults) + " faults, " +
                                std::to_string(there) + " are there");
  }
}

LiveScenario::LiveScenario(Scenario scenario, std::vector<Line*> lines,
                           std::function<void()> on_over,
                           std::function<std::optional<std::string>()> body_failure)
    : scenario_(std::move(scenario)),
      on_over_(std::move(on_over)),
      body_failure_(std::move(body_failure)),
      began_(monotonic_now()) {
  check_room(scenario_, lines);
  for (std::size_t n = 0; n < lines.size(); ++n) {
    const Bus& bus = lines[n]->bus();
    const SimTime start = bus.time();
    parts_.push_back(std::unique_ptr<Part>(  // NOLINT(modernize-make-unique): by name
        new Part{.line = lines[n],
                 .host = HostScript(scenario_.sends, n, start),
                 .judge = Judge(scenario_.robot[n], scenario_.expectations, n, start),
                 .errors = ErrorWatch(scenario_.robot[n], start),
                 .events = scenario_.robot[n].events,
                 .beginning = {start, bus.state().faults.armed(),
                               bus.state().conditions.directives()}}));
    Part& part = *parts_.back();
    Watcher watcher;
    watcher.next_due = [this, &part] { return next_due(part); };
    watcher.sample = [this, &part](const Bus& at) { on_due(part, at); };
    part.watcher = part.line->watchers.insert(part.line->watchers.end(), std::move(watcher));
    Listener listener;
    listener.query = [&part](const TimedFrame& query) {
      part.judge.on_query(query, part.line->bus());
    };
    listener.reply = [&part](const TimedFrame& reply) { on_reply(part, reply); };
    part.listener = part.line->listeners.insert(part.line->listeners.end(), std::move(listener));
  }
}

SimTime LiveScenario::next_due(const Part& part) const {
  if (part.over) return SimTime::max();
  SimTime due = std::min({part.beginning.start + scenario_.duration, part.judge.next_due(),
                          part.errors.next_due(), part.host.next_due()});
  if (part.next_event < part.events.size()) {
    due = std::min(due, part.beginning.start + part.events[part.next_event].at);
  }
  return due;
}

/// Executes what is due, in the order of `lk-emu run`: events, checks, frames of the host.
void LiveScenario::on_due(Part& part, const Bus& bus) {
  const SimTime now = bus.time();
  perform_due(part, now);
  if (part.judge.next_due() <= now) part.judge.sample(bus);
  if (part.errors.next_due() <= now) part.errors.sample(bus);
  while (part.host.next_due() <= now) part.line->accept(part.host.take());
  if (now < part.beginning.start + scenario_.duration) return;
  end(part);
  const bool all =
      std::ranges::all_of(parts_, [](const auto& one) { return one->over.has_value(); });
  if (all && on_over_) on_over_();
}

void LiveScenario::on_reply(Part& part, const TimedFrame& reply) {
  part.judge.on_reply(reply);
  if (part.over || reply.echo) return;
  ++part.replies;
  // 64-bit FNV-1a: gives the same hash on every machine.
  std::uint64_t hash = part.replies_hash != 0 ? part.replies_hash : 0xCBF29CE484222325U;
  const SimTime at = reply.at - part.beginning.start;
  for (const char c : std::to_string(at.count()) + ' ' + frame_text(reply.frame) + '\n') {
    hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001B3U;
  }
  part.replies_hash = hash;
}

void LiveScenario::perform_due(Part& part, SimTime now) {
  while (part.next_event < part.events.size() &&
         part.beginning.start + part.events[part.next_event].at <= now) {
    TimedDirective event = part.events[part.next_event++];
    const SimTime planned = std::exchange(event.at, now);
    if (!event.source_json.empty()) part.line->announce(event.source_json);
    if (part.line->perform(event)) continue;
    part.refused.push_back(part.line->name() + ": the event planned for " + time_text(planned) +
                           " found no room on the bus; clear faults or conditions before it");
  }
}

RunReport LiveScenario::report() const {
  if (final_) return *final_;
  RunReport report;
  report.name = scenario_.name;
  report.about = scenario_.about;
  report.seed = scenario_.robot.front().seed;
  report.simulated = SimTime::max();
  report.wall_s = std::chrono::duration<double>(monotonic_now() - began_).count();
  for (const auto& part : parts_) {
    const Bus& bus = part->line->bus();
    const SimTime reached = part->over ? part->over_at : bus.time();
    report.drives += bus.size();
    report.simulated =
        std::min({report.simulated, reached - part->beginning.start, scenario_.duration});
    Verdict verdict = part->over ? *part->over : verdict_of(*part);
    std::ranges::move(verdict.expectations, std::back_inserter(report.verdict.expectations));
    std::ranges::move(verdict.faults, std::back_inserter(report.verdict.faults));
    std::ranges::move(verdict.invalid, std::back_inserter(report.verdict.invalid));
    report.verdict.unasked.take(verdict.unasked);
    report.accounts.push_back({part->line->name(), part->beginning.start, part->errors.firsts(),
                               part->replies, part->replies_hash});
  }
  if (const auto failure = body_failure_()) report.verdict.invalid.push_back(*failure);
  conclude(report.verdict);
  return report;
}

Verdict LiveScenario::verdict_of(const Part& part) const {
  Verdict verdict;
  const Bus& bus = part.line->bus();
  add_to_verdict(part.judge, bus, part.line->name(), part.beginning, verdict);
  std::ranges::copy(part.refused, std::back_inserter(verdict.invalid));
  return verdict;
}

void LiveScenario::end(Part& part) {
  part.over = verdict_of(part);
  part.over_at = part.line->bus().time();
  const SimTime ran = part.over_at - part.beginning.start;
  if (ran < scenario_.duration) {
    part.over->invalid.push_back(part.line->name() + ": cut short at " + time_text(ran) + " of " +
                                 time_text(scenario_.duration));
  }
  for (; part.next_event < part.events.size(); ++part.next_event) {
    const TimedDirective& event = part.events[part.next_event];
    if (const auto* const set = std::get_if<SetFault>(&event.directive.what)) {
      part.over->invalid.push_back(part.line->name() + ": fault " +
                                   std::string(set->fault.row->word) + " planned for " +
                                   time_text(event.at) + " never began");
    }
  }
  for (const FaultReport& report : part.line->bus().faults()) {
    const auto state = report.evidence.state;
    if (report.order < part.beginning.faults || state == FaultEvidence::State::kOver ||
        state == FaultEvidence::State::kCleared) {
      continue;
    }
    request_clear(*part.line, report.fault.name);
  }
}

void LiveScenario::finish() {
  if (final_) return;
  for (const auto& part : parts_) {
    if (!part->over) end(*part);
  }
  final_ = report();
  for (const auto& part : parts_) {
    part->line->watchers.erase(part->watcher);
    part->line->listeners.erase(part->listener);
  }
}

}  // namespace lk::emulator
