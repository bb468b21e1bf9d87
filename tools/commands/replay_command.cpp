#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "emulator/config/candump_log.hpp"
#include "emulator/config/config_reader.hpp"
#include "emulator/core/start_error.hpp"
#include "emulator/files/output_file.hpp"
#include "emulator/files/profile_files.hpp"
#include "emulator/monitor/record/log_compare.hpp"
#include "emulator/monitor/record/replay.hpp"
#include "emulator/monitor/scenario/csv_writer.hpp"
#include "emulator/monitor/scenario/scenario_report.hpp"
#include "emulator/monitor/scenario/scenario_runner.hpp"
#include "tools/commands/arguments.hpp"
#include "tools/commands/cli.hpp"
#include "tools/commands/commands.hpp"

namespace lk::emulator {
namespace {

constexpr const char* kReplayFooter = R"(
Exit status: 0 the replies are the recorded ones, or a log was compared; 1 they are not, or
nothing could be printed; 2 unusable input.)";

struct ReplayRequest {
  std::string directory;
  std::string candump;
  bool marks = false;
  std::string capture;
  std::string csv;
  std::vector<std::string> signals = {"angle_deg", "speed_dps", "iq_A"};
  double rate_Hz = 100;
  std::string log;
  std::string config;
  std::string bus;
  std::string report;
};

void add_options(CLI::App& app, ReplayRequest& request) {
  app.add_option("DIR", request.directory, "directory of the recording to run again");
  app.add_option("--candump", request.candump, "file that gets the frames of the replay")
      ->type_name("FILE");
  app.add_flag("--marks", request.marks,
               "mark the lines of --candump: T from a host, R from a drive");
  app.add_option("--capture", request.capture, "file that gets the frames as pcapng, for Wireshark")
      ->type_name("FILE");
  app.add_option("--csv", request.csv, "file that gets signals of the drives")->type_name("FILE");
  app.add_option("--signals", request.signals, "signals to write: angle_deg,speed_dps,…")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->type_name("SIGNALS");
  app.add_option("--rate", request.rate_Hz, "rows per simulated second (default 100)")
      ->type_name("HZ");
  app.add_option("--log", request.log, "a real robot's candump -L log instead of a recording")
      ->type_name("FILE");
  app.add_option("--config", request.config, "robot that produced the log")->type_name("ROBOT");
  app.add_option("--bus", request.bus, "bus of the configuration, and its name in the log")
      ->type_name("BUS[=NAME]");
  app.add_option("--report", request.report, "file for the comparison (default: standard output)")
      ->type_name("FILE");
}

void check(const CLI::App& app, const ReplayRequest& request) {
  const bool log = app.count("--log") > 0;
  if (log == !request.directory.empty()) {
    throw StartError(log ? "replay: a recording or a --log, not both"
                         : "replay: needs the directory of a recording, or --log FILE");
  }
  if (log) {
    refuse_options(app, {"--candump", "--capture", "--csv"}, "replay: {} belongs to a recording");
  } else {
    refuse_options(app, {"--config", "--bus", "--report"}, "replay: {} belongs to --log");
  }
  if (request.candump.empty()) refuse_options(app, {"--marks"}, "replay: {} belongs to --candump");
  if (request.csv.empty()) {
    refuse_options(app, {"--signals", "--rate"}, "replay: {} belongs to --csv");
  }
  if (log && request.config.empty()) {
    throw StartError("replay: --log needs --config, the robot that produced the log");
  }
}

// --- replay of a recording

ReplayCsv read_csv(const ReplayRequest& request) {
  const SimTime period = row_period(request.rate_Hz);
  return {request.csv, find_signals(request.signals, nullptr), period};
}

Recording open_recording(const std::string& directory) {
  Recording recording = read_recording(directory);
  if (!recording.info.replayable) {
    throw StartError(fmt::format(
        "{} cannot be replayed: it was begun {:.3f} s after the drives; start with --record DIR "
        "to have one that can",
        directory, in_seconds(recording.info.start)));
  }
  return recording;
}

/// Returns the length of a recording; 0 if the recording was interrupted and has no end.
SimTime length(const Recording& recording) {
  SimTime last{0};
  for (const RecordedInput& input : recording.inputs) {
    if (std::holds_alternative<RecordedInput::End>(input.what)) last = std::max(last, input.at);
  }
  return last;
}

ReplayEnd run(const ReplayRequest& request, const Recording& recording, Replay& replay) {
  FrameOutputs outputs;
  if (!request.candump.empty()) outputs.candump = request.candump;
  if (!request.capture.empty()) outputs.capture = request.capture;
  outputs.marks = request.marks;
  FrameFiles frames(outputs, recording.buses);
  std::optional<ReplayCsvFile> csv;
  if (outputs.candump || outputs.capture) {
    replay.on_frame = [&](std::size_t bus, const ReplayedFrame& frame) {
      frames.write(bus, frame.timed.at, frame.timed.frame, frame.from_host);
    };
  }
  if (!request.csv.empty()) csv.emplace(read_csv(request), recording.buses, replay);
  const SimTime whole = length(recording);
  Progress progress("replay", whole, whole > SimTime{0} && ::isatty(STDERR_FILENO) != 0);
  const ReplayEnd end = replay_recording(request.directory, recording, replay,
                                         [&](SimTime now) { progress.show(now); });
  frames.commit();
  if (csv) csv->commit();
  return end;
}

int replay_recorded(const ReplayRequest& request) {
  const Recording recording = open_recording(request.directory);
  Replay replay(recording.buses);
  const ReplayEnd end = run(request, recording, replay);
  if (const auto& difference = replay.difference()) {
    const auto bus = std::ranges::find(recording.buses, difference->bus, &BusConfig::interface);
    std::fputs(difference_text(*difference, *bus, recording.info).c_str(), stdout);
    return 1;
  }
  std::string ending;
  if (!end.complete) {
    ending = fmt::format(" up to {:.6f} s, where the recording breaks off", in_seconds(end.until));
  }
  const auto frames = replay.host_frames();
  const auto replies = replay.equal_replies();
  std::printf("%s\n",
              fmt::format("{} frame{}, {} repl{}, identical{}", frames, frames == 1 ? "" : "s",
                          replies, replies == 1 ? "y" : "ies", ending)
                  .c_str());
  return 0;
}

// --- replay of a log

/// A bus of the configuration, and the name of its interface in the log; empty if not given.
struct ChosenBus {
  BusConfig config;
  std::string name;
};

ChosenBus choose_bus(const ReplayRequest& request) {
  CommandLine command_line;
  command_line.config_file = request.config;
  const auto buses = load_config(command_line);
  if (request.bus.empty() && buses.size() == 1) return {buses.front(), ""};
  if (request.bus.empty()) {
    throw StartError("replay: " + request.config + " has several buses; choose one with --bus");
  }
  const std::size_t sign = request.bus.rfind('=');
  for (const BusConfig& bus : buses) {
    if (bus.interface == request.bus) return {bus, ""};
    if (sign != std::string::npos && bus.interface == request.bus.substr(0, sign)) {
      return {bus, request.bus.substr(sign + 1)};
    }
  }
  throw StartError("replay: " + request.config + " has no bus " + request.bus.substr(0, sign));
}

/// Returns the name that a bus has in a log: "ttyUSB0" for "rs485:/dev/ttyUSB0".
std::string short_name(const std::string& bus) { return bus.substr(bus.find_last_of("/:") + 1); }

/// Returns the interface to read: that of the bus, or the only one in the log.
std::string find_interface(const std::vector<CandumpLine>& lines, const ChosenBus& bus,
                           const std::string& file) {
  std::set<std::string> all;
  for (const CandumpLine& line : lines) all.insert(line.interface);
  if (!bus.name.empty()) {
    if (all.contains(bus.name)) return bus.name;
    throw StartError(fmt::format("replay: {} has no interface {}, but {}", file, bus.name,
                                 fmt::join(all, ", ")));
  }
  for (const std::string& name : {bus.config.interface, short_name(bus.config.interface)}) {
    if (all.contains(name)) return name;
  }
  if (all.size() == 1) return *all.begin();
  throw StartError(
      fmt::format("replay: {} has the interfaces {}, not {}; choose one with --bus {}=NAME", file,
                  fmt::join(all, ", "), bus.config.interface, bus.config.interface));
}

/// Longest allowed time without frames. A longer gap means that the clock was set, e.g. from 1970
/// to the present, and would take too long to emulate.
constexpr SimTime kLongestSilence = std::chrono::hours(1);

void check_silences(const std::vector<LoggedFrame>& frames, const std::string& file) {
  for (std::size_t n = 1; n < frames.size(); ++n) {
    const SimTime silence = frames[n].timed.at - frames[n - 1].timed.at;
    if (silence <= kLongestSilence) continue;
    throw StartError(fmt::format(
        "replay: {}:{}: comes {:.0f} s after the frame before it, and no silence may be longer "
        "than an hour: if the clock was set, cut the log there",
        file, frames[n].line, in_seconds(silence)));
  }
}

std::vector<LoggedFrame> frames_of(const std::vector<CandumpLine>& lines, const ChosenBus& bus,
                                   const std::string& file) {
  if (lines.empty()) throw StartError("replay: " + file + " has no frames");
  const std::string interface = find_interface(lines, bus, file);
  std::vector<LoggedFrame> frames;
  for (const CandumpLine& line : lines) {
    if (line.interface != interface) continue;
    LoggedFrame frame{{line.at, line.frame}, std::nullopt, line.number};
    if (line.direction != CandumpLine::Direction::kUnknown) {
      frame.from_host = line.direction == CandumpLine::Direction::kSent;
    }
    frames.push_back(frame);
  }
  std::ranges::stable_sort(frames, {}, [](const LoggedFrame& frame) { return frame.timed.at; });
  check_silences(frames, file);
  return frames;
}

int compare(const ReplayRequest& request) {
  const ChosenBus bus = choose_bus(request);
  std::vector<CandumpLine> lines;
  try {
    lines = parse_candump_log(read_regular_file(request.log, kLongestLog), request.log);
  } catch (const ConfigError& problem) {
    throw StartError(problem.what());
  } catch (const std::invalid_argument& problem) {
    throw StartError(problem.what());
  }
  const auto comparison = compare_log(frames_of(lines, bus, request.log), bus.config);
  const std::string text = comparison_text(comparison);
  if (request.report.empty()) {
    std::fputs(text.c_str(), stdout);
  } else {
    OutputFile report(request.report, "--report");
    report.write(text);
    report.commit();
    std::printf("%s\n", text.substr(0, text.find('\n')).c_str());
  }
  return 0;
}

}  // namespace

RunCommand declare_replay(CLI::App& app, Arguments /*arguments*/) {
  const auto request = std::make_shared<ReplayRequest>();
  app.footer(kReplayFooter);
  add_options(app, *request);
  return [request, &app] {
    check(app, *request);
    return request->log.empty() ? replay_recorded(*request) : compare(*request);
  };
}

}  // namespace lk::emulator
