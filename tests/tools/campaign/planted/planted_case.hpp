#pragma once

/// @file From the values of a case to a scenario, and from a scenario and a host to what came of
/// them.

#include <algorithm>
#include <chrono>
#include <limits>
#include <span>
#include <vector>

#include "emulator/core/scenario/scenario_run.hpp"
#include "tests/tools/campaign/planted/planted.hpp"

namespace lk::emulator::planted {

struct PlantedCase {
  Scenario scenario;
  HostValues host;
};

/// The scenario of a bug without any fault.
Scenario base_scenario(const Bug& bug);
/// Throws std::invalid_argument for a value that is none of these dimensions or words.
PlantedCase case_of(const Scenario& base, const Values& values);

/// How far what is expected of signals stood from its bounds, so far.
class MarginWatch {
 public:
  explicit MarginWatch(const Scenario& scenario);
  /// At every millisecond.
  void look(const Bus& bus);
  /// The worst of all; 1 where nothing has a width.
  double margin() const;

 private:
  struct Watched {
    const Expectation* expectation;
    double margin;  // so far
  };
  std::vector<Watched> watched_;
};

using Heard = std::span<const TimedFrame>;    // replies since the last call
using Frames = std::vector<protocol::Frame>;  // to be sent now

/// Calls the host every millisecond, from 0 to the end of the scenario.
template <class Host>
PlantedRun run_host(const Scenario& scenario, Host host) {
  ScenarioRun run(scenario);
  MarginWatch watch(scenario);
  std::vector<Traffic> traffic;
  std::vector<TimedFrame> heard;
  Frames out;
  while (run.time() < scenario.duration) {
    watch.look(run.bus(0));
    out.clear();
    host.step(run.time(), Heard(heard), out);
    for (const protocol::Frame& frame : out) run.receive(0, {run.time(), frame});
    run.advance_to(run.time() + std::chrono::milliseconds(1));
    traffic.clear();
    heard.clear();
    run.take_traffic(traffic);
    for (const Traffic& one : traffic) {
      if (!one.from_host) heard.push_back(one.frame);
    }
  }
  watch.look(run.bus(0));
  const Verdict verdict = run.verdict();
  PlantedRun result;
  result.failed = std::ranges::any_of(verdict.expectations, [](const ExpectationResult& one) {
    return one.status == ExpectationResult::Status::kFailed;
  });
  result.fired = std::ranges::any_of(verdict.faults, &PlannedFault::took_effect);
  result.margin = watch.margin();
  return result;
}

template <class Host>
PlantedRun run_with(const Scenario& scenario, const HostValues& host) {
  return run_host(scenario, Host(host));
}

}  // namespace lk::emulator::planted
