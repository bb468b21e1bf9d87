#include "tools/campaign/run/offline.hpp"

#include <algorithm>
#include <iterator>
#include <tuple>
#include <utility>

#include "emulator/core/scenario/scenario_fleet.hpp"
#include "emulator/core/scenario/scenario_text.hpp"

namespace lk::emulator {
namespace {

constexpr std::size_t kTogether = 8;  // drives in one block of a bank
constexpr std::size_t kMostGroups = 64;
// Traffic is heard in pieces, so that a long scenario needs no more memory than a short one.
constexpr SimTime kPiece = std::chrono::milliseconds(500);

/// Brings `run` to `until`, alone, and hears what is said on the way.
void bring_to(ScenarioRun& run, TrafficWatch& watch, SimTime until) {
  std::vector<Traffic> traffic;
  while (run.time() < until) {
    run.advance_to(std::min(until, run.time() + kPiece));
    traffic.clear();
    run.take_traffic(traffic);
    watch.hear(traffic);
  }
}

std::string hexadecimal(std::uint8_t byte) {
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  return {kDigits[byte >> 4U], kDigits[byte & 0xFU]};
}

/// The drive that a fault is of; the first one of its bus, where it is of the bus.
int drive_of(const PlannedDirective& planned, const Bus& bus) {
  const auto* set = std::get_if<SetFault>(&planned.directive.directive.what);
  if (set != nullptr && !set->fault.ids.empty()) return set->fault.ids.front();
  int id = protocol::kMinId;
  while (!bus.has(id)) ++id;
  return id;
}

std::string state_of(const Bus& bus, int id) {
  const model::Telemetry telemetry = bus.telemetry(id);
  return telemetry.alive ? state_word(bus.servo(id).run_state(telemetry)) : "no power";
}

SimTime begin_of(const std::vector<PlannedDirective>& fault) {
  return fault.empty() ? SimTime{0} : fault.front().directive.at;
}

}  // namespace

OfflineRunner::OfflineRunner(const Plan& plan, OfflineSharing sharing)
    : plan_(plan), sharing_(sharing), scenarios_(plan) {}

OfflineRunner::Group& OfflineRunner::group_of(const CaseValues& values) {
  auto& group = groups_[scenarios_.group_key(values)];
  if (!group) group = std::make_unique<Group>(Group{scenarios_.group(values), std::nullopt});
  return *group;
}

std::vector<OfflineRunner::Lane> OfflineRunner::lanes_of(std::span<const CaseToRun> cases) {
  std::vector<std::pair<std::string, Lane>> keyed;
  for (const CaseToRun& one : cases) {
    Lane lane;
    lane.one = &one;
    lane.group = &group_of(one.values);
    lane.fault = scenarios_.fault(one.values, lane.group->group.scenario);
    keyed.emplace_back(scenarios_.group_key(one.values), std::move(lane));
  }
  std::ranges::sort(keyed, {}, [](const auto& one) {
    return std::tuple(one.first, begin_of(one.second.fault), one.second.one->number);
  });
  std::vector<Lane> lanes;
  for (auto& [key, lane] : keyed) lanes.push_back(std::move(lane));
  return lanes;
}

std::vector<CaseResult> OfflineRunner::run(std::span<const CaseToRun> cases) {
  std::vector<CaseResult> results;
  run(cases, [&](std::vector<CaseResult> some) {
    std::ranges::move(some, std::back_inserter(results));
    return true;
  });
  std::ranges::sort(results, {}, &CaseResult::number);
  return results;
}

void OfflineRunner::run(std::span<const CaseToRun> cases, const ResultTaker& take) {
  if (groups_.size() > kMostGroups) groups_.clear();
  std::vector<Lane> lanes = lanes_of(cases);
  std::vector<Lane> mixed;  // those that have little company of their own
  for (auto first = lanes.begin(); first != lanes.end();) {
    const auto last = std::find_if(first, lanes.end(),
                                   [&](const Lane& lane) { return lane.group != first->group; });
    if (last - first >= static_cast<std::ptrdiff_t>(kTogether / 2)) {
      if (!run_group({first, last}, take)) return;
    } else {
      mixed.insert(mixed.end(), first, last);
    }
    first = last;
  }
  for (std::size_t n = 0; n < mixed.size(); n += kTogether) {
    const auto some = std::span(mixed).subspan(n, std::min(kTogether, mixed.size() - n));
    if (!run_mixed(some, take)) return;
  }
}

bool OfflineRunner::run_group(std::span<Lane> lanes, const ResultTaker& take) {
  Group& group = *lanes.front().group;
  Start base{ScenarioRun(group.group.scenario), {}};
  const std::size_t together = sharing_.lanes ? kTogether : 1;
  for (std::size_t n = 0; n < lanes.size(); n += together) {
    const auto some = lanes.subspan(n, std::min(together, lanes.size() - n));
    if (sharing_.prefix) bring_to(base.run, base.watch, begin_of(some.front().fault) - SimTime{1});
    run_together(some, std::vector(some.size(), base));
    if (!group.end) group.end = seen_without(group, base);
    if (!take(judged(some))) return false;
  }
  return true;
}

/// A group without a fault, from where it has come to.
SeenRun OfflineRunner::seen_without(const Group& group, Start from) const {
  bring_to(from.run, from.watch, group.group.scenario.duration);
  return {from.run.verdict(), from.watch.heard()};
}

bool OfflineRunner::run_mixed(std::span<Lane> lanes, const ResultTaker& take) {
  std::vector<Start> starts;
  std::vector<Lane> without;  // a fault: the references that are missing
  std::vector<Start> without_starts;
  for (const Lane& lane : lanes) {
    starts.push_back({ScenarioRun(lane.group->group.scenario), {}});
    const bool known =
        lane.group->end || std::ranges::find(without, lane.group, &Lane::group) != without.end();
    if (known) continue;
    without.emplace_back().group = lane.group;
    without_starts.push_back(starts.back());
  }
  if (!without.empty()) run_together(without, without_starts);
  for (Lane& lane : without) lane.group->end = std::move(lane.seen);
  run_together(lanes, starts);
  return take(judged(lanes));
}

void OfflineRunner::run_together(std::span<Lane> lanes, const std::vector<Start>& starts) const {
  std::vector<ScenarioRun> runs;
  SimTime end{0};
  std::vector<SimTime> stops;  // just before a fault begins
  for (std::size_t n = 0; n < lanes.size(); ++n) {
    Lane& lane = lanes[n];
    runs.push_back(starts[n].run);
    lane.watch = starts[n].watch;
    for (const PlannedDirective& one : lane.fault) runs.back().plan(one.bus, one.directive);
    end = std::max(end, lane.group->group.scenario.duration);
    stops.push_back(begin_of(lane.fault) - SimTime{1});
  }
  ScenarioFleet fleet(std::move(runs));
  std::vector<Traffic> traffic;
  const auto look = [&](std::size_t n) {
    Lane& lane = lanes[n];
    traffic.clear();
    fleet.take_traffic(n, traffic);
    lane.watch.hear(traffic);
    if (lane.fault.empty() || !lane.state.empty() || stops[n] > fleet.time()) return;
    const std::size_t bus = lane.fault.front().bus;
    const int id = drive_of(lane.fault.front(), fleet.run(n).bus(bus));
    const auto command = lane.watch.command(bus, id);
    lane.state = state_of(fleet.run(n).bus(bus), id);
    lane.command = command ? hexadecimal(*command) : "none";
  };
  for (std::size_t n = 0; n < lanes.size(); ++n) look(n);
  while (fleet.time() < end) {
    SimTime until = std::min(end, fleet.time() + kPiece);
    for (const SimTime stop : stops) {
      if (stop > fleet.time()) until = std::min(until, stop);
    }
    fleet.advance_to(until);
    for (std::size_t n = 0; n < lanes.size(); ++n) look(n);
  }
  for (std::size_t n = 0; n < lanes.size(); ++n) {
    lanes[n].seen = {fleet.run(n).verdict(), lanes[n].watch.heard()};
  }
}

std::vector<CaseResult> OfflineRunner::judged(std::span<const Lane> lanes) const {
  std::vector<CaseResult> results;
  for (const Lane& lane : lanes) results.push_back(judged(lane));
  return results;
}

CaseResult OfflineRunner::judged(const Lane& lane) const {
  CaseResult result;
  result.number = lane.one->number;
  result.generation = lane.one->generation;
  result.values = lane.one->values;
  result.state = lane.state;
  result.command = lane.command;
  judge_case(lane.group->group, *lane.group->end, lane.seen, plan_.head.tolerant_time, result);
  return result;
}

}  // namespace lk::emulator
