#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "emulator/core/bus/motors.hpp"
#include "emulator/core/scenario/scenario_run.hpp"

namespace lk::emulator {

/// Scenario runs computed side by side, so that all drives fill the SIMD lanes of the processor.
/// Each result equals that of a single run, to the bit.
class ScenarioFleet {
 public:
  /// Pre: at least one run, all at the same `time()`. The runs may differ in everything else.
  explicit ScenarioFleet(std::vector<ScenarioRun> runs);
  ScenarioFleet(const ScenarioFleet&) = delete;
  ScenarioFleet(ScenarioFleet&&) noexcept = default;
  ScenarioFleet& operator=(const ScenarioFleet&) = delete;
  ScenarioFleet& operator=(ScenarioFleet&&) noexcept = default;
  ~ScenarioFleet() = default;

  SimTime time() const { return runs_.front().time(); }
  std::size_t size() const { return runs_.size(); }
  /// Advances all runs, even those whose scenarios end before `until`.
  void advance_to(SimTime until);
  /// The run `n`, at `time()`. A copy of the run continues without the fleet.
  const ScenarioRun& run(std::size_t n) const { return runs_[n]; }

  // As in ScenarioRun, for the run `n`. `receive` advances all runs to the frame's time.
  bool plan(std::size_t n, std::size_t bus, const TimedDirective& event) {
    return runs_[n].plan(bus, event);
  }
  void receive(std::size_t n, std::size_t bus, const TimedFrame& in);
  void take_traffic(std::size_t n, std::vector<Traffic>& out) { runs_[n].take_traffic(out); }
  void take_rom_writes(std::size_t n, std::size_t bus, std::vector<RomWrite>& out) {
    runs_[n].take_rom_writes(bus, out);
  }

 private:
  /// Progress of a bus of a run.
  struct BusProgress {
    std::size_t run;
    std::size_t bus;
    SimTime waits_for;  // time that its motors must reach; SimTime::max(): the bus has arrived
  };
  void advance_all(SimTime until);
  void continue_bus(BusProgress& one, SimTime until);

  std::vector<ScenarioRun> runs_;
  std::vector<BusProgress> progress_;
  std::optional<SharedMotors> motors_;
};

}  // namespace lk::emulator
