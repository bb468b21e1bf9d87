// usage: traces FILE
// Writes the results of the libraries to FILE: a line for each run, with a hash of all bits. The
// file is equal on all processors and systems (docs/internals/testing.md, "Elsewhere").

#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "emulator/config/scenario/scenario_file.hpp"
#include "emulator/core/scenario/scenario_run.hpp"
#include "tests/elsewhere/bus_life.hpp"
#include "tests/support/golden_trace.hpp"

namespace lk::test {
namespace {

using namespace std::chrono_literals;

std::string hex(std::uint64_t value) {
  char digits[20];
  std::snprintf(digits, sizeof digits, "%016llx", static_cast<unsigned long long>(value));
  return digits;
}

/// Returns the names of the files of a folder of configs/, without ".toml", in order.
std::vector<std::string> names_in(const char* folder) {
  std::vector<std::string> names;
  const auto path = std::filesystem::path(LKEMU_SOURCE_DIR) / "configs" / folder;
  for (const auto& entry : std::filesystem::directory_iterator(path)) {
    if (entry.path().extension() == ".toml") names.push_back(entry.path().stem().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

/// The model alone: drives in lanes, single drives, and faulty ones, with this machine's kernel.
void trace_model(std::ostream& out) {
  using namespace model::test;
  const auto line = [&out](const char* how, int kind, const std::vector<std::uint64_t>& words) {
    Hash hash;
    for (const std::uint64_t word : words) hash.add(word);
    out << "model " << how << ' ' << kind << ' ' << hex(hash.value()) << '\n';
  };
  const std::vector<int> kinds{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10};
  const auto together = mixed_run(kinds, model::best_lane_kernel());
  const auto broken = mixed_run(kinds, model::best_lane_kernel(), kStretchTicks, true);
  for (const int kind : kinds) {
    line("lanes", kind, together[static_cast<std::size_t>(kind)]);
    line("broken", kind, broken[static_cast<std::size_t>(kind)]);
    line("alone", kind, mixed_run({kind}, model::best_lane_kernel()).front());
  }
}

/// The golden trace, with replies written by hand.
void trace_golden(std::ostream& out) {
  const GoldenTrace golden = golden_trace("resting_drive.log");
  emulator::Bus bus(resting_drive());
  for (const emulator::TimedFrame& frame : golden.sent) bus.receive(frame);
  bus.advance_to(1s);
  std::vector<emulator::TimedFrame> replies;
  bus.take_replies(replies);
  bool same = replies.size() == golden.expected.size();
  for (std::size_t n = 0; same && n < replies.size(); ++n) {
    same = replies[n].at == golden.expected[n].at && replies[n].frame == golden.expected[n].frame;
  }
  if (!same) throw std::runtime_error("resting_drive.log has other replies");
  out << "golden resting_drive.log " << replies.size() << " replies\n";
}

/// Random runs of buses.
void trace_lives(std::ostream& out) {
  const std::vector<std::string> motors = names_in("motors");
  for (const bool serial : {false, true}) {
    for (const std::uint64_t seed : {1U, 2U, 3U}) {
      const int drives = seed == 1 ? 32 : seed == 2 ? 5 : 2;
      RandomBusRun life(every_kind(motors, drives, serial, seed));
      life.live_until(2s);
      out << "life " << (serial ? "RS-485 " : "CAN ") << drives << " drives, " << life.frames()
          << " frames " << hex(life.hash()) << '\n';
    }
  }
}

std::vector<emulator::BusConfig> robot(const std::string& name,
                                       const emulator::Overrides& overrides) {
  const bool of_scenarios = name.starts_with("robots/");
  const std::string file = of_scenarios ? "scenarios/" + name : "buses/" + name + ".toml";
  return emulator::parse_config(fuzz::shipped_text(file), file, overrides, fuzz::shipped_profile);
}

/// Skips robots with a body: MuJoCo simulates them, and is not available everywhere.
template <class Trace>
void trace_unless_it_has_a_body(const Trace& trace) {
  try {
    trace();
  } catch (const emulator::ConfigError& problem) {
    if (problem.key != "body") throw;
  }
}

/// The shipped robots without queries, and resolution of file names.
void trace_robots(std::ostream& out) {
  out << "path " << emulator::motor_of("robots/arm.toml", "./motors/mine.toml") << '\n';
  for (const std::string& name : names_in("buses")) {
    trace_unless_it_has_a_body([&] {
      Hash hash;
      for (const emulator::BusConfig& config : robot(name, {})) {
        emulator::Bus bus(config);
        bus.advance_to(100ms);
        for (const emulator::ServoConfig& servo : config.servos) add(hash, bus.view(servo.id));
      }
      out << "robot " << name << ' ' << hex(hash.value()) << '\n';
    });
  }
}

/// All frames and measurements of a scenario, for at most three seconds.
void trace_scenario(const std::string& name, std::ostream& out) {
  const std::string file = "scenarios/" + name + ".toml";
  const emulator::ScenarioFiles files{.robot = robot, .text = [](const std::string& log) {
                                        return fuzz::shipped_text("scenarios/" + log);
                                      }};
  const emulator::Scenario scenario =
      emulator::parse_scenario(fuzz::shipped_text(file), file, std::nullopt, files);
  emulator::ScenarioRun run(scenario);
  run.advance_to(std::min<emulator::SimTime>(scenario.duration, 3s));
  Hash hash;
  std::vector<emulator::Traffic> traffic;
  run.take_traffic(traffic);
  for (const emulator::Traffic& one : traffic) add(hash, one.frame);
  for (const emulator::ExpectationResult& result : run.verdict().expectations) {
    for (const char c : result.expected + result.measured + result.description) {
      hash.add(static_cast<unsigned char>(c));
    }
  }
  out << "scenario " << name << ' ' << traffic.size() << " frames " << hex(hash.value()) << '\n';
}

void trace_all(std::ostream& out) {
  trace_model(out);
  trace_golden(out);
  trace_lives(out);
  trace_robots(out);
  for (const std::string& name : names_in("scenarios")) {
    trace_unless_it_has_a_body([&] { trace_scenario(name, out); });
  }
}

}  // namespace
}  // namespace lk::test

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fputs("usage: traces FILE\n", stderr);
    return 2;
  }
  try {
    std::ofstream out(argv[1], std::ios::binary);
    lk::test::trace_all(out);
    out.close();
    if (out) return 0;
    std::fprintf(stderr, "traces: %s cannot be written\n", argv[1]);
  } catch (const std::exception& problem) {
    std::fprintf(stderr, "traces: %s\n", problem.what());
  }
  return 1;
}
