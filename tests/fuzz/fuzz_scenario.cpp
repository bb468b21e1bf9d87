// A scenario with any text: it is refused in one line, or runs, alone and on a running bus.
//
// Input: the text of a scenario; after a line "---" that of the log "log", if it plays one.

#include <cstddef>
#include <string>

#include "emulator/config/scenario/config_scenario.hpp"
#include "emulator/core/scenario/scenario_run.hpp"
#include "emulator/io/program/live_scenario.hpp"
#include "tests/fuzz/shipped.hpp"
#include "tests/fuzz/support.hpp"

namespace lk::emulator {
namespace {

using fuzz::require;

// Limits an input to milliseconds.
constexpr std::size_t kMaxDrives = 4;
constexpr SimTime kRun = std::chrono::milliseconds(5);

std::size_t drives_of(const std::vector<BusConfig>& robot) {
  std::size_t drives = 0;
  for (const BusConfig& bus : robot) drives += bus.servos.size();
  return drives;
}

ScenarioFiles files_with(const std::string& log) {
  return {
      .robot =
          [](const std::string& name, const Overrides& overrides) {
            const std::string robot =
                name.substr(name.starts_with("robots/") ? std::string_view("robots/").size() : 0);
            const std::string stem = robot.substr(0, robot.find('.'));
            if (!fuzz::plain_name(stem)) throw std::invalid_argument("no such robot");
            const std::string folder = stem.size() == name.size() ? "buses/" : "scenarios/robots/";
            const std::string& text = fuzz::shipped_text(folder + stem + ".toml");
            if (text.empty()) throw std::invalid_argument("no such robot");
            return parse_config(text, stem, overrides, fuzz::shipped_profile);
          },
      .text =
          [&log](const std::string& name) {
            if (name != "log") throw std::invalid_argument("no such log");
            return log;
          }};
}

/// A scenario has a verdict at any time.
void run(const Scenario& scenario) {
  ScenarioRun one(scenario);
  const SimTime end = std::min(scenario.duration, kRun);
  one.advance_to(end / 2);
  require(one.verdict().expectations.size() == scenario.expectations.size());
  one.advance_to(end);
  require(one.verdict().expectations.size() == scenario.expectations.size());
  std::vector<Traffic> traffic;
  one.take_traffic(traffic);
  for (const Traffic& frame : traffic) require(frame.bus < one.size());
}

void run_live(const std::string& text, const ScenarioFiles& files) {
  static const std::vector<BusConfig> kRunning = parse_config(
      fuzz::shipped_text("scenarios/robots/joint.toml"), "joint", {}, fuzz::shipped_profile);
  const Scenario scenario = parse_live_scenario(text, "live.toml", kRunning, files);
  Line line(kRunning.front());
  LiveScenario live(
      scenario, {&line}, [] {}, [] { return std::nullopt; });
  line.advance_to(std::min(scenario.duration, kRun), MonoTime::max(), Line::WaitPolicy::kNone);
  live.finish();
  require(live.report().verdict.expectations.size() == scenario.expectations.size());
}

template <class Try>
void attempt(const Try& what) {
  try {
    what();
  } catch (const ConfigError& problem) {
    fuzz::require_one_line(problem.what());
  } catch (const std::invalid_argument&) {  // too many faults for a bus
  }
}

void check(std::string log) {
  const std::string text = fuzz::take_part(log);
  const ScenarioFiles files = files_with(log);
  attempt([&] {
    const Scenario scenario = parse_scenario(text, "scenario.toml", std::nullopt, files);
    if (drives_of(scenario.robot) <= kMaxDrives) run(scenario);
  });
  attempt([&] { run_live(text, files); });
}

}  // namespace
}  // namespace lk::emulator

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  lk::emulator::check({reinterpret_cast<const char*>(data), size});
  return 0;
}
