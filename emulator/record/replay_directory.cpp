#include "emulator/record/replay_directory.hpp"

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

#include "emulator/config/candump_log.hpp"
#include "emulator/config/events/config_directives.hpp"
#include "emulator/files/json_table.hpp"
#include "emulator/files/regular_file.hpp"
#include "emulator/ground/start_error.hpp"

namespace lk::emulator {
namespace {

/// Lines between two calls of `progress`.
constexpr int kLinesBetweenReports = 4096;

/// Longer than any frame.
constexpr std::size_t kLongestLine = 4096;

/// Reads a file line by line, as it may be larger than memory.
class Lines {
 public:
  explicit Lines(const std::filesystem::path& file) : file_(file.string()), buffer_(kLongestLine) {
    try {
      open_regular_file(file);
    } catch (const std::invalid_argument& problem) {
      throw StartError(problem.what());
    }
    stream_.open(file, std::ios::binary);
    if (!stream_) {
      throw StartError("cannot read " + file_ + ": " + std::generic_category().message(errno));
    }
  }
  /// Returns false at the end, and at a line without an end.
  bool next(std::string& line) {
    stream_.getline(buffer_.data(), static_cast<std::streamsize>(buffer_.size()));
    if (stream_.bad()) throw StartError("cannot read " + file_);
    if (stream_.eof() && stream_.gcount() == 0) return false;
    ++number_;
    cut_ = stream_.eof();
    if (stream_.fail()) fail("is longer than any line of a recording");
    line = buffer_.data();
    return !cut_;
  }
  bool cut() const { return cut_; }
  int number() const { return number_; }
  [[noreturn]] void fail(const std::string& reason) const {
    throw StartError(file_ + ":" + std::to_string(number_) + ": " + reason);
  }

 private:
  std::string file_;
  std::ifstream stream_;
  std::vector<char> buffer_;
  int number_ = 0;
  bool cut_ = false;
};

/// Performs recorded inputs other than frames, each at its time.
class Inputs {
 public:
  Inputs(const Recording& recording, Replay& replay)
      : recording_(recording), replay_(replay), next_(recording.inputs.begin()) {}

  /// Performs the inputs before the next host frame.
  void do_before_next_frame() {
    while (next_ != recording_.inputs.end() && !replay_.difference() &&
           next_->after_frames <= replay_.host_frames()) {
      perform(*next_++);
    }
  }
  /// Performs the rest; in a truncated recording, only inputs followed by further frames.
  void finish() {
    const bool all = complete();
    for (; next_ != recording_.inputs.end() && !replay_.difference(); ++next_) {
      if (all || (next_->after_frames <= replay_.host_frames() &&
                  next_->at < replay_.last(bus_of(*next_)))) {
        perform(*next_);
      }
    }
  }
  /// Returns true if all buses have an end.
  bool complete() const {
    const auto ends = std::ranges::count_if(recording_.inputs, [](const RecordedInput& input) {
      return std::holds_alternative<RecordedInput::End>(input.what);
    });
    return static_cast<std::size_t>(ends) == recording_.buses.size();
  }

 private:
  void perform(const RecordedInput& input) {
    const std::size_t bus = bus_of(input);
    if (std::holds_alternative<RecordedInput::End>(input.what)) {
      replay_.end(bus, input.at);
      return;
    }
    if (!replay_.bring(bus, input.at)) return;
    const BusConfig& config = recording_.buses[bus];
    if (const auto* request = std::get_if<RecordedInput::Request>(&input.what)) {
      request_directive(*request, config, replay_.bus(bus));
    } else {
      restore(std::get<RecordedInput::RestoredRom>(input.what), config, replay_.bus(bus));
    }
  }
  std::size_t bus_of(const RecordedInput& input) const {
    if (const auto bus = replay_.find(input.bus)) return *bus;
    throw StartError(std::string(kInputsFile) + ": no bus " + input.bus + " in this recording");
  }
  static void request_directive(const RecordedInput::Request& request, const BusConfig& config,
                                Bus& bus) {
    // Settings that are not given keep their value in RAM.
    BusConfig now = config;
    for (ServoConfig& servo : now.servos) servo.rom = bus.servo(servo.id).ram();
    const toml::table table = to_table(parse_json(request.json));
    TableReader reader(table, kInputsFile, "");
    reader.text("bus");
    for (const TimedDirective& one : read_directives(reader, now, Timing::kOptional)) {
      if (one.when || one.at > bus.time()) {
        bus.plan(one);
      } else {
        bus.apply(one.directive);
      }
    }
  }
  static void restore(const RecordedInput::RestoredRom& restored, const BusConfig& config,
                      Bus& bus) {
    const auto servo = std::ranges::find(config.servos, restored.id, &ServoConfig::id);
    if (servo == config.servos.end()) {
      throw StartError(std::string(kInputsFile) + ": no drive " + std::to_string(restored.id) +
                       " on " + config.interface);
    }
    bus.restore_rom(restored.id, restored_rom(restored, config.interface, *servo), restored.wear);
  }

  const Recording& recording_;
  Replay& replay_;
  std::vector<RecordedInput>::const_iterator next_;
};

void feed(const CandumpLine& line, const Lines& lines, Replay& replay) {
  const auto bus = replay.find(line.interface);
  if (!bus) lines.fail("no bus " + line.interface + " in this recording");
  if (line.direction == CandumpLine::Direction::kUnsaid) {
    lines.fail("neither T, a host's frame, nor R, a drive's, is behind the frame");
  }
  if (line.direction == CandumpLine::Direction::kSent) {
    replay.host_frame(*bus, line.at, line.frame);
  } else {
    replay.recorded_reply(*bus, {line.at, line.frame});
  }
}

}  // namespace

ReplayEnd replay_recording(const std::filesystem::path& directory, const Recording& recording,
                           Replay& replay, const std::function<void(SimTime)>& progress) {
  ReplayEnd end;
  Lines lines(directory / kFramesFile);
  Inputs inputs(recording, replay);
  std::string text;
  try {
    while (!replay.difference() && lines.next(text)) {
      const auto parsed = parse_candump_line(text);
      if (const auto* problem = std::get_if<std::string>(&parsed)) lines.fail(*problem);
      const auto& line = std::get<CandumpLine>(parsed);
      if (line.direction == CandumpLine::Direction::kSent) inputs.do_before_next_frame();
      feed(line, lines, replay);
      if (progress && lines.number() % kLinesBetweenReports == 0) progress(line.at);
    }
    if (!replay.difference()) inputs.finish();
  } catch (const ConfigError& problem) {
    throw StartError(problem.what());
  } catch (const JsonError& problem) {
    throw StartError(std::string(kInputsFile) + ": " + problem.where + ": " + problem.what());
  }
  end.cut_line = lines.cut();
  end.complete = inputs.complete();
  for (const RecordedInput& input : recording.inputs) {
    if (!std::holds_alternative<RecordedInput::End>(input.what) || replay.difference()) continue;
    if (input.after_frames > replay.host_frames()) {
      throw StartError(std::string(kFramesFile) + ": incomplete, it has " +
                       std::to_string(replay.host_frames()) + " of " +
                       std::to_string(input.after_frames) + " frames of hosts");
    }
  }
  if (!end.complete) replay.break_off();
  for (std::size_t bus = 0; bus < recording.buses.size(); ++bus) {
    end.until = std::max(end.until, replay.last(bus));
  }
  return end;
}

}  // namespace lk::emulator
