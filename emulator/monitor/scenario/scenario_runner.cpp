#include "emulator/monitor/scenario/scenario_runner.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <map>
#include <stdexcept>
#include <system_error>
#include <utility>
#include <vector>

#include "emulator/config/candump_log.hpp"
#include "emulator/core/scenario/scenario_text.hpp"
#include "emulator/core/servo/signals.hpp"
#include "emulator/core/sim_time.hpp"
#include "emulator/core/start_error.hpp"
#include "emulator/core/text.hpp"
#include "emulator/files/durable_file.hpp"
#include "emulator/files/output_file.hpp"
#include "emulator/files/profile_files.hpp"
#include "emulator/files/rom_store.hpp"
#include "emulator/monitor/advice/adviser.hpp"
#include "emulator/monitor/frames/frame_words.hpp"
#include "emulator/monitor/scenario/csv_writer.hpp"
#include "emulator/monitor/scenario/pcapng.hpp"
#include "emulator/monitor/scenario/scenario_report.hpp"

namespace lk::emulator {
namespace {

namespace fs = std::filesystem;

fs::path robot_file(const std::string& name, const fs::path& directory) {
  return is_path(name) ? directory / name : shipped_file(kRobots, name);
}

/// Returns "; its drive 1 on vcan0 is mg8016, here it is mf7015 (and 2 more)", or "".
std::string foreign_text(const Scenario& scenario) {
  if (scenario.mismatches.empty()) return "";
  const DriveMismatch& first = scenario.mismatches.front();
  const std::string here =
      first.running.empty() ? "missing here" : "here it is " + sanitized_line(first.running);
  const std::size_t more = scenario.mismatches.size() - 1;
  return "; its drive " + std::to_string(first.id) + " on " + sanitized_line(first.bus) + " is " +
         sanitized_line(first.meant) + ", " + here +
         (more > 0 ? " (and " + std::to_string(more) + " more)" : "");
}

template <class Parse>
Scenario load(Parse parse) {
  try {
    return parse();
  } catch (const ConfigError& problem) {
    throw StartError(problem.what());
  } catch (const std::invalid_argument& problem) {
    throw StartError(problem.what());
  }
}

}  // namespace

ScenarioFiles scenario_files(const fs::path& directory, FileLimits limits) {
  return {
      .robot =
          [directory, limits](const std::string& name, const Overrides& overrides) {
            const fs::path file = robot_file(name, directory);
            MotorFiles motors;
            return parse_config(read_regular_file(file, std::min(limits.each, kLongestText)),
                                file.string(), overrides, profile_finder(motors), body_loader());
          },
      .text =
          [directory, limits, played = std::uintmax_t{0}](const std::string& name) mutable {
            if (limits.no_logs) {
              throw std::invalid_argument("only clients of the Unix socket may play logs");
            }
            std::string text = read_regular_file(directory / name, limits.each);
            played += text.size();
            if (played <= limits.played) return text;
            throw std::invalid_argument("the logs to play are longer than " +
                                        std::to_string(limits.played) + " bytes in all");
          },
  };
}

Scenario load_scenario(const std::string& given, std::optional<std::uint64_t> seed) {
  return load([&] {
    const fs::path file = meant_file(kScenarios, given);
    return parse_scenario(read_regular_file(file, kLongestText), file.string(), seed,
                          scenario_files(file.parent_path()));
  });
}

Scenario load_live_scenario(const std::string& given, const std::vector<BusConfig>& running,
                            FileLimits limits) {
  Scenario scenario = load([&] {
    const fs::path file = meant_file(kScenarios, given);
    return parse_live_scenario(read_regular_file(file, limits.each), file.string(), running,
                               scenario_files(file.parent_path(), limits));
  });
  if (!scenario.robot_name.empty()) {
    spdlog::info("scenario {}: its robot {} is not used, the drives are those that run{}",
                 sanitized_line(scenario.name), sanitized_line(scenario.robot_name),
                 foreign_text(scenario));
  }
  return scenario;
}

FrameFiles::FrameFiles(const FrameOutputs& outputs, std::span<const BusConfig> buses)
    : marks_(outputs.marks) {
  for (const BusConfig& bus : buses) buses_.push_back(bus.interface);
  if (outputs.candump) candump_.emplace(*outputs.candump, "--candump");
  if (!outputs.capture) return;
  capture_.emplace(*outputs.capture, "--capture");
  const std::vector<CapturedBus> captured(buses.begin(), buses.end());
  capture_->write(pcapng_begin(captured));
}

void FrameFiles::write(std::size_t bus, SimTime at, const protocol::Frame& frame, bool from_host) {
  using Direction = CandumpLine::Direction;
  if (candump_) {
    const Direction direction = !marks_     ? Direction::kUnknown
                                : from_host ? Direction::kSent
                                            : Direction::kReceived;
    candump_->write(candump_line(at, buses_[bus], frame, direction) + '\n');
  }
  if (capture_) capture_->write(pcapng_frame(bus, at, frame, from_host));
}

void FrameFiles::commit() {
  if (candump_) candump_->commit();
  if (capture_) capture_->commit();
}

namespace {

/// Time between two observations by the advisers, which need the state of the drives at each frame.
constexpr SimTime kChunk = Adviser::kObservePeriod;

void open_csv(std::optional<CsvFile>& file, const RunOutputs::Csv& csv, const Scenario& scenario) {
  for (const int id : csv.ids) {
    const bool known = std::ranges::any_of(scenario.robot, [id](const BusConfig& bus) {
      return std::ranges::find(bus.servos, id, &ServoConfig::id) != bus.servos.end();
    });
    if (!known) throw StartError("--ids: the robot has no drive " + std::to_string(id));
  }
  const BodySignals* const body = scenario.robot.front().body_signals.get();
  file.emplace(csv.file, scenario.robot, find_signals(csv.signals, body), csv.ids, csv.period);
}

/// Saves ROM to files; each write is on the disk before the run continues.
class RomOutput {
 public:
  RomOutput(const std::filesystem::path& directory, Scenario& scenario)
      : store_({.directory = directory, .in_memory = false, .wipe = false}, scenario.robot) {}
  void write(ScenarioRun& run) {
    for (std::size_t n = 0; n < run.size(); ++n) {
      writes_.clear();
      run.take_rom_writes(n, writes_);
      for (const RomWrite& write : writes_) {
        const RomFile& place = store_.place(n, write.id);
        // The first write also syncs the directory, as a file is only as durable as its directory.
        int error = std::exchange(durable_, true) ? 0 : sync_entry(place.directory_fd);
        if (error == 0) {
          error = write_durably(place.directory_fd, place.name,
                                print_rom(place.owner, write.rom, write.wear));
        }
        if (error == 0) continue;
        throw StartError("--rom: cannot write " + place.name + ": " +
                         std::generic_category().message(error));
      }
    }
  }

 private:
  RomStore store_;
  bool durable_ = false;
  std::vector<RomWrite> writes_;
};

/// Passes frames to the advisers: up to kChunk late, but with the original times.
void pass_on(const std::vector<Traffic>& traffic, std::vector<Adviser>& advisers) {
  for (const Traffic& one : traffic) {
    Adviser& adviser = advisers[one.bus];
    if (one.from_host) {
      adviser.on_query(one.frame);
    } else if (!one.frame.echo) {
      adviser.on_reply(one.frame);
    }
  }
}

/// Collects warnings on protections that trip before the first frame and the first event, so that
/// all frames go to a drive with an error. Misses a trip less than kChunk before the first frame.
struct EarlyTrips {
  std::map<std::pair<std::size_t, int>, model::ErrorBits> known;  // by bus and ID
  std::vector<std::string> warnings;                              // one per drive and protection

  /// Call every kChunk until a frame comes.
  void observe(const std::vector<BusConfig>& robot, const ScenarioRun& run) {
    for (std::size_t n = 0; n < robot.size(); ++n) {
      const bool acted = !robot[n].events.empty() && robot[n].events.front().at <= run.time();
      for (const ServoConfig& servo : robot[n].servos) {
        const model::ErrorBits errors = run.bus(n).telemetry(servo.id).errors;
        model::ErrorBits& before = known[{n, servo.id}];
        for (const std::string_view word : error_words(acted ? 0U : errors & ~before)) {
          warnings.push_back(fmt::format(
              "{} drive {}: {} trips at {}, before the first frame; check settings.protection.{}",
              robot[n].interface, servo.id, word, time_text(run.time()), word));
        }
        before |= errors;
      }
    }
  }
};

}  // namespace

RunReport run_scenario(Scenario scenario, const RunOutputs& outputs) {
  std::optional<RomOutput> rom;
  std::optional<CsvFile> csv;
  if (outputs.rom) rom.emplace(*outputs.rom, scenario);
  if (outputs.csv) open_csv(csv, *outputs.csv, scenario);
  FrameFiles frames(outputs.frames, scenario.robot);
  Progress progress(scenario.name, scenario.duration, outputs.progress);
  ScenarioRun run(scenario);
  std::vector<Adviser> advisers(scenario.robot.begin(), scenario.robot.end());
  EarlyTrips early_trips;
  bool frames_came = false;
  std::vector<Traffic> traffic;
  for (;;) {
    SimTime until = std::min((run.time() / kChunk + 1) * kChunk, scenario.duration);
    if (csv) until = std::min(until, csv->next_due(0));
    run.advance_to(until);
    if (csv && csv->next_due(0) <= run.time()) {
      for (std::size_t n = 0; n < run.size(); ++n) csv->sample(n, run.bus(n));
    }
    traffic.clear();
    run.take_traffic(traffic);
    pass_on(traffic, advisers);
    frames_came = frames_came || std::ranges::any_of(traffic, &Traffic::from_host);
    // Advisers observe at multiples of kChunk and at the end, whichever outputs are written.
    const bool whole = run.time() > SimTime{0} && run.time() % kChunk == SimTime{0};
    if (whole || run.time() >= scenario.duration) {
      for (std::size_t n = 0; n < run.size(); ++n) advisers[n].observe(run.bus(n));
      if (!frames_came) early_trips.observe(scenario.robot, run);
    }
    for (const Traffic& one : traffic) {
      frames.write(one.bus, one.frame.at, one.frame.frame, one.from_host);
    }
    if (rom) rom->write(run);
    progress.show(run.time());
    if (run.time() >= scenario.duration) break;
  }
  if (csv) csv->commit();
  frames.commit();
  std::vector<GivenAdvice> given;
  std::size_t drives = 0;
  for (std::size_t n = 0; n < run.size(); ++n) {
    drives += scenario.robot[n].servos.size();
    for (const Advice& one : advisers[n].advice()) {
      given.push_back({scenario.robot[n].interface, one});
    }
  }
  return {.name = scenario.name,
          .about = scenario.about,
          .seed = scenario.robot.front().seed,
          .drives = drives,
          .simulated = scenario.duration,
          .wall_s = progress.wall_s(),
          .verdict = run.verdict(),
          .advice = std::move(given),
          .strict = outputs.strict,
          .warnings = frames_came ? early_trips.warnings : std::vector<std::string>()};
}

}  // namespace lk::emulator
