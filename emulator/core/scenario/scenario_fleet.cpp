#include "emulator/core/scenario/scenario_fleet.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

namespace lk::emulator {

ScenarioFleet::ScenarioFleet(std::vector<ScenarioRun> runs) : runs_(std::move(runs)) {
  assert(!runs_.empty());
  std::vector<Motors*> motors;
  for (std::size_t run = 0; run < runs_.size(); ++run) {
    assert(runs_[run].time() == time());
    for (std::size_t bus = 0; bus < runs_[run].size(); ++bus) {
      progress_.push_back({run, bus, SimTime::max()});
      motors.push_back(&runs_[run].lines_[bus].bus.state().motors);
    }
  }
  motors_.emplace(motors);
}

void ScenarioFleet::continue_bus(BusProgress& one, SimTime until) {
  ScenarioRun& run = runs_[one.run];
  const bool due = run.coupling_ && run.coupling_->next_due() == until;
  const bool there = due ? run.reach(one.bus, until) : run.advance(one.bus, until);
  one.waits_for = there ? SimTime::max() : run.bus(one.bus).state().waits_for;
}

/// Motors advance together to the earliest time that a bus waits for, so they never pass it.
void ScenarioFleet::advance_all(SimTime until) {
  for (BusProgress& one : progress_) continue_bus(one, until);
  for (;;) {
    const SimTime next = std::ranges::min(progress_, {}, &BusProgress::waits_for).waits_for;
    if (next == SimTime::max()) break;
    const bool edge = motors_->advance_to(next);
    for (BusProgress& one : progress_) {
      // After a drive has died or started, its bus must react before motors continue.
      if (one.waits_for == next || edge) continue_bus(one, until);
    }
  }
}

void ScenarioFleet::advance_to(SimTime until) {
  const auto due = [](const ScenarioRun& run) {
    return run.coupling_ ? run.coupling_->next_due() : SimTime::max();
  };
  for (;;) {
    const SimTime next = due(*std::ranges::min_element(runs_, {}, due));
    if (next > until) break;
    advance_all(next);
    for (ScenarioRun& run : runs_) {
      if (due(run) == next) run.exchange();
    }
  }
  advance_all(until);
  for (ScenarioRun& run : runs_) run.merge_traffic(until);
}

void ScenarioFleet::receive(std::size_t n, std::size_t bus, const TimedFrame& in) {
  advance_to(std::max(in.at, time()));
  runs_[n].send(bus, {time(), in.frame});
  runs_[n].merge_traffic(time());
}

}  // namespace lk::emulator
