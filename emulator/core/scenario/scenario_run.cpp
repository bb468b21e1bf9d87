#include "emulator/core/scenario/scenario_run.hpp"

#include <algorithm>
#include <cmath>

#include "emulator/core/faults/fault_table.hpp"
#include "emulator/core/scenario/sampler.hpp"
#include "emulator/core/scenario/scenario_text.hpp"

namespace lk::emulator {
namespace {

using Status = ExpectationResult::Status;

std::string invalid_text(const PlannedFault& fault) {
  const FaultEvidence& evidence = fault.report.evidence;
  const std::string name = fault.bus + ": fault " + fault.report.fault.name;
  if (!evidence.began_at) return name + " never began";
  return name + " began at " + time_text(*evidence.began_at) + " and changed nothing";
}

}  // namespace

void add_to_verdict(const Judge& judge, const Bus& bus, const std::string& interface,
                    const Beginning& beginning, Verdict& verdict) {
  for (ExpectationResult& result : judge.results(bus.time())) {
    verdict.expectations.push_back(std::move(result));
  }
  std::size_t dropped = bus.state().faults.armed() - beginning.faults;
  for (const FaultReport& report : bus.faults()) {
    if (report.order < beginning.faults) continue;
    --dropped;
    PlannedFault fault{interface, report};
    FaultEvidence& evidence = fault.report.evidence;
    evidence.armed_at -= beginning.start;
    if (evidence.began_at) *evidence.began_at -= beginning.start;
    if (evidence.first_effect_at) *evidence.first_effect_at -= beginning.start;
    if (!fault.took_effect()) verdict.invalid.push_back(invalid_text(fault));
    verdict.faults.push_back(std::move(fault));
  }
  if (dropped > 0) {
    verdict.invalid.push_back(
        interface + ": " + std::to_string(dropped) + (dropped == 1 ? " fault" : " faults") +
        " ended and were removed before the verdict to make room; their effect is unknown");
  }
  for (int id = protocol::kMinId; id <= protocol::kMaxId; ++id) {
    if (!bus.has(id)) continue;
    UnaskedMotion unasked = bus.state().nodes.of(id).unasked.worst();
    unasked.from -= beginning.start;
    if (unasked.from >= SimTime{0}) verdict.unasked.take({interface, id, unasked});
    const model::Truth truth = bus.truth(id);
    const double plant = truth.theta_m + truth.omega_m + truth.i_q + truth.v_bus;
    const double loops =
        truth.theta_ref + truth.omega_ref + truth.i_q_ref + bus.telemetry(id).omega;
    if (!std::isfinite(plant + loops)) {
      verdict.invalid.push_back(interface + " drive " + std::to_string(id) +
                                ": the simulation diverged; check the parameters of its motor");
    }
  }
  const std::size_t unmet = bus.state().conditions.directives();
  if (unmet > beginning.unmet) {
    verdict.invalid.push_back(interface + ": " + std::to_string(unmet - beginning.unmet) +
                              " events wait for a condition that never held");
  }
}

void conclude(Verdict& verdict) {
  const auto count = [&](Status status) {
    return std::ranges::count(verdict.expectations, status, &ExpectationResult::status);
  };
  if (const auto open = count(Status::kOpen); open > 0) {
    verdict.invalid.push_back(std::to_string(open) + " expectations were still open at the end");
  }
  verdict.outcome = !verdict.invalid.empty()     ? Outcome::kInvalid
                    : count(Status::kFailed) > 0 ? Outcome::kFailed
                                                 : Outcome::kPassed;
}

ScenarioRun::ScenarioRun(const Scenario& scenario) {
  lines_.reserve(scenario.robot.size());
  for (std::size_t n = 0; n < scenario.robot.size(); ++n) {
    const BusConfig& config = scenario.robot[n];
    lines_.push_back({config.interface,
                      Bus(config),
                      HostScript(scenario.sends, n, SimTime{0}),
                      Judge(config, scenario.expectations, n, SimTime{0}),
                      {}});
  }
  if (!Coupling::needed(scenario.robot)) return;
  coupling_.emplace(scenario.robot, buses());
}

std::vector<Bus*> ScenarioRun::buses() {
  std::vector<Bus*> all;
  for (Line& line : lines_) all.push_back(&line.bus);
  return all;
}

void ScenarioRun::advance_to(SimTime until) {
  while (coupling_ && coupling_->next_due() <= until) {
    for (std::size_t n = 0; n < lines_.size(); ++n) reach(n, coupling_->next_due());
    exchange();
  }
  for (std::size_t n = 0; n < lines_.size(); ++n) advance(n, until);
  merge_traffic(until);
}

void ScenarioRun::merge_traffic(SimTime until) {
  time_ = std::max(time_, until);
  const std::size_t first = traffic_.size();
  for (Line& line : lines_) {
    traffic_.insert(traffic_.end(), line.traffic.begin(), line.traffic.end());
    line.traffic.clear();
  }
  if (lines_.size() > 1) {
    std::ranges::stable_sort(traffic_.begin() + static_cast<std::ptrdiff_t>(first), traffic_.end(),
                             {}, [](const Traffic& one) { return one.frame.at; });
  }
}

void ScenarioRun::receive(std::size_t index, const TimedFrame& in) {
  advance_to(std::max(in.at, time_));
  send(index, {time_, in.frame});
  merge_traffic(time_);
}

void ScenarioRun::send(std::size_t index, const TimedFrame& query) {
  Line& line = lines_[index];
  line.judge.on_query(query, line.bus);
  line.traffic.push_back({index, query, true});
  line.bus.receive(query);
}

bool ScenarioRun::reach(std::size_t index, SimTime due) {
  return advance(index, due - SimTime{1}) && lines_[index].bus.reach(due);
}

void ScenarioRun::exchange() { coupling_->exchange(buses()); }

bool ScenarioRun::advance(std::size_t index, SimTime until) {
  Line& line = lines_[index];
  const auto take_replies = [&] {
    replies_.clear();
    line.bus.take_replies(replies_);
    for (const TimedFrame& reply : replies_) {
      line.judge.on_reply(reply);
      line.traffic.push_back({index, reply, false});
    }
  };
  while (line.host.next_due() <= until) {
    const SimTime due = line.host.next_due();
    if (!deliver_watched(line.bus, due, line.judge)) return false;
    // With an adapter or a full queue, Bus::receive advances the bus, and cannot wait for shared
    // motors. So advance the bus before.
    const bool moves = line.bus.state().adapted() || line.bus.state().wire.host_queue_full();
    if (moves && !line.bus.advance_to(due)) return false;
    take_replies();
    send(index, line.host.take());
  }
  if (!advance_watched(line.bus, until, line.judge)) return false;
  take_replies();
  return true;
}

void ScenarioRun::take_traffic(std::vector<Traffic>& out) {
  out.insert(out.end(), traffic_.begin(), traffic_.end());
  traffic_.clear();
}

Verdict ScenarioRun::verdict() const {
  Verdict verdict;
  for (const Line& line : lines_) {
    add_to_verdict(line.judge, line.bus, line.interface, {}, verdict);
  }
  if (coupling_ && coupling_->failure()) verdict.invalid.push_back(*coupling_->failure());
  conclude(verdict);
  return verdict;
}

}  // namespace lk::emulator
