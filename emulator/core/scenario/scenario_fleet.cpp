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
      travellers_.push_back({run, bus, SimTime::max()});
      motors.push_back(&runs_[run].lines_[bus].bus.motors());
    }
  }
  motors_.emplace(motors);
}

void ScenarioFleet::go_on(Traveller& traveller, SimTime until) {
  ScenarioRun& run = runs_[traveller.run];
  const bool due = run.coupling_ && run.coupling_->next_due() == until;
  const bool there = due ? run.reach(traveller.bus, until) : run.advance(traveller.bus, until);
  traveller.waits_for = there ? SimTime::max() : run.bus(traveller.bus).waits_for();
}

/// Motors advance together to the next instant at which a bus waits for its own. So they never pass
/// a bus that waits.
void ScenarioFleet::travel_to(SimTime until) {
  for (Traveller& traveller : travellers_) go_on(traveller, until);
  for (;;) {
    const SimTime next = std::ranges::min(travellers_, {}, &Traveller::waits_for).waits_for;
    if (next == SimTime::max()) break;
    const bool edge = motors_->advance_to(next);
    for (Traveller& traveller : travellers_) {
      // After a drive has died or started, its bus must react before motors continue.
      if (traveller.waits_for == next || edge) go_on(traveller, until);
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
    travel_to(next);
    for (ScenarioRun& run : runs_) {
      if (due(run) == next) run.exchange();
    }
  }
  travel_to(until);
  for (ScenarioRun& run : runs_) run.arrive(until);
}

void ScenarioFleet::receive(std::size_t n, std::size_t bus, const TimedFrame& in) {
  advance_to(std::max(in.at, time()));
  runs_[n].put(bus, {time(), in.frame});
  runs_[n].arrive(time());
}

}  // namespace lk::emulator
