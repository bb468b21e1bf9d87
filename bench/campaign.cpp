// Cases per second of a fault campaign: scenario jammed_joint plus one fault per case, of varying
// kind and time.
#include <benchmark/benchmark.h>

#include <chrono>
#include <filesystem>
#include <vector>

#include "emulator/config/scenario/scenario_file.hpp"
#include "emulator/core/scenario/scenario_fleet.hpp"
#include "tests/support/faults.hpp"
#include "tests/support/profile.hpp"

namespace lk::emulator {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t kCases = 64;
constexpr std::size_t kFleet = 8;

std::string text_of(const std::filesystem::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

Scenario jammed_joint() {
  const std::filesystem::path folder =
      std::filesystem::path(LKEMU_SOURCE_DIR) / "configs/scenarios";
  const auto robot = [&](const std::string& name, const Overrides& overrides) {
    return parse_config(text_of(folder / name), name, overrides, test::profile);
  };
  return parse_scenario(text_of(folder / "jammed_joint.toml"), "jammed_joint.toml", std::nullopt,
                        {.robot = robot, .text = {}});
}

/// Eight kinds in turn, half a second each, from 0.5 s to 4.5 s, in ascending order of time.
TimedDirective fault_of(std::size_t number) {
  const Fault kinds[] = {test::fault_of("jam", {100.0}),
                         test::fault_of("encoder_stuck"),
                         test::fault_of("drop"),
                         test::fault_of("friction", {3.0}),
                         test::fault_of("phase_open"),
                         test::fault_of("hang"),
                         test::fault_of("voltage_off", {-4.0}),
                         test::fault_of("sag", {9.0})};
  Fault fault = kinds[number % std::size(kinds)];
  fault.ids = {1};
  fault.duration = 500ms;
  const SimTime step = SimTime(4s) / kCases;
  return {500ms + step * static_cast<int>(number), {kWholeBus, SetFault{fault}}};
}

void count(benchmark::State& state) {
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(kCases));
}

void end(const ScenarioRun& run) {
  const Verdict verdict = run.verdict();
  benchmark::DoNotOptimize(&verdict);
}

void BM_CampaignAlone(benchmark::State& state) {
  const Scenario scenario = jammed_joint();
  for (auto _ : state) {
    for (std::size_t number = 0; number < kCases; ++number) {
      ScenarioRun run(scenario);
      run.plan(0, fault_of(number));
      run.advance_to(scenario.duration);
      end(run);
    }
  }
  count(state);
}
BENCHMARK(BM_CampaignAlone)->Unit(benchmark::kMillisecond);

void finish(ScenarioFleet fleet, std::size_t first, SimTime duration) {
  for (std::size_t n = 0; n < kFleet; ++n) fleet.plan(n, 0, fault_of(first + n));
  fleet.advance_to(duration);
  for (std::size_t n = 0; n < kFleet; ++n) end(fleet.run(n));
}

void BM_CampaignFleet(benchmark::State& state) {
  const Scenario scenario = jammed_joint();
  for (auto _ : state) {
    for (std::size_t first = 0; first < kCases; first += kFleet) {
      finish(ScenarioFleet(std::vector(kFleet, ScenarioRun(scenario))), first, scenario.duration);
    }
  }
  count(state);
}
BENCHMARK(BM_CampaignFleet)->Unit(benchmark::kMillisecond);

void BM_CampaignFleetFromFault(benchmark::State& state) {
  const Scenario scenario = jammed_joint();
  for (auto _ : state) {
    ScenarioRun common(scenario);
    for (std::size_t first = 0; first < kCases; first += kFleet) {
      common.advance_to(fault_of(first).at - 1ns);
      finish(ScenarioFleet(std::vector(kFleet, common)), first, scenario.duration);
    }
  }
  count(state);
}
BENCHMARK(BM_CampaignFleetFromFault)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace lk::emulator
