#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "emulator/core/node/motors.hpp"
#include "emulator/core/scenario/scenario_run.hpp"

namespace lk::emulator {

/// Scenario runs that are computed side by side, so that the drives of all of them fill the lanes
/// of the processor. Each gives, to the bit, what it gives alone.
class ScenarioFleet {
 public:
  /// All at the same `time()`; they may differ in everything else. At least one.
  explicit ScenarioFleet(std::vector<ScenarioRun> runs);
  ScenarioFleet(const ScenarioFleet&) = delete;
  ScenarioFleet(ScenarioFleet&&) noexcept = default;
  ScenarioFleet& operator=(const ScenarioFleet&) = delete;
  ScenarioFleet& operator=(ScenarioFleet&&) noexcept = default;
  ~ScenarioFleet() = default;

  SimTime time() const { return runs_.front().time(); }
  std::size_t size() const { return runs_.size(); }
  /// All of them, whether or not their scenarios are over before.
  void advance_to(SimTime until);
  /// As it stands at `time()`. A copy of it leaves the fleet and goes on alone.
  const ScenarioRun& run(std::size_t n) const { return runs_[n]; }

  // Those of the run `n` (ScenarioRun). `receive` brings all runs to the frame's time.
  bool plan(std::size_t n, std::size_t bus, const TimedDirective& event) {
    return runs_[n].plan(bus, event);
  }
  void receive(std::size_t n, std::size_t bus, const TimedFrame& in);
  void take_traffic(std::size_t n, std::vector<Traffic>& out) { runs_[n].take_traffic(out); }
  void take_rom_writes(std::size_t n, std::size_t bus, std::vector<RomWrite>& out) {
    runs_[n].take_rom_writes(bus, out);
  }

 private:
  /// A bus of a run, on its way.
  struct Traveller {
    std::size_t run;
    std::size_t bus;
    SimTime waits_for;  // until its motors have got there; SimTime::max(): it has arrived
  };
  void travel_to(SimTime until);
  void go_on(Traveller& traveller, SimTime until);

  std::vector<ScenarioRun> runs_;
  std::vector<Traveller> travellers_;
  std::optional<SharedMotors> motors_;
};

}  // namespace lk::emulator
