#include "emulator/monitor/record/replay.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

#include "emulator/config/candump_log.hpp"
#include "emulator/config/events/config_directives.hpp"
#include "emulator/core/frame_text.hpp"
#include "emulator/core/start_error.hpp"
#include "emulator/files/json_table.hpp"
#include "emulator/files/output_file.hpp"
#include "emulator/monitor/frames/log_pairing.hpp"

namespace lk::emulator {
namespace {

using std::chrono::microseconds;

bool same(const TimedFrame& a, const TimedFrame& b) {
  return a.frame == b.frame &&
         std::chrono::floor<microseconds>(a.at) == std::chrono::floor<microseconds>(b.at);
}

std::optional<TimedFrame> front(const std::deque<TimedFrame>& frames) {
  return frames.empty() ? std::nullopt : std::optional(frames.front());
}

}  // namespace

Replay::Replay(const std::vector<BusConfig>& buses) {
  for (const BusConfig& bus : buses)
    lines_.push_back({bus.interface, Bus(bus), {}, {}, {}, SimTime{0}});
}

std::optional<std::size_t> Replay::find(std::string_view interface) const {
  const auto found = std::ranges::find(lines_, interface, &Line::interface);
  return found != lines_.end() ? std::optional(static_cast<std::size_t>(found - lines_.begin()))
                               : std::nullopt;
}

void Replay::host_frame(std::size_t n, SimTime at, const protocol::Frame& frame) {
  end(n, at);
  if (difference_) return;
  ++host_frames_;
  const TimedFrame timed{at, frame};
  if (on_frame) on_frame(n, {timed, true});
  note(lines_[n], {timed, true});
  lines_[n].bus.receive(timed);
}

void Replay::recorded_reply(std::size_t n, const TimedFrame& reply) {
  lines_[n].recorded.push_back(reply);
  lines_[n].last = std::max(lines_[n].last, reply.at + microseconds(1) - SimTime(1));
}

bool Replay::advance_to(std::size_t n, SimTime at) {
  if (difference_) return false;
  run(n, at);
  Line& line = lines_[n];
  const bool missing =
      !line.recorded.empty() && line.recorded.front().at < std::chrono::floor<microseconds>(at);
  if (missing || !line.replayed.empty()) differ(line);
  return !difference_;
}

void Replay::end(std::size_t n, SimTime at) {
  if (difference_) return;
  Line& line = lines_[n];
  line.last = std::max(line.last, at);
  run(n, at);
  if (!line.recorded.empty() || !line.replayed.empty()) differ(line);
}

void Replay::break_off() {
  for (std::size_t n = 0; n < lines_.size() && !difference_; ++n) {
    run(n, lines_[n].last);
    if (!lines_[n].recorded.empty()) differ(lines_[n]);
  }
}

void Replay::run(std::size_t n, SimTime until) {
  Line& line = lines_[n];
  advance(n, until);
  taken_.clear();
  line.bus.take_replies(taken_);
  // Discards the ROM writes. If a write failed in the recorded run, a later input restores the ROM.
  std::vector<RomWrite> kept;
  line.bus.take_rom_writes(kept);
  for (const TimedFrame& reply : taken_) {
    if (on_frame) on_frame(n, {reply, false});
    line.replayed.push_back(reply);
  }
  compare(line);
}

void Replay::compare(Line& line) {
  while (!difference_ && !line.recorded.empty() && !line.replayed.empty()) {
    if (!same(line.recorded.front(), line.replayed.front())) {
      differ(line);
      return;
    }
    note(line, {line.replayed.front(), false});
    line.recorded.pop_front();
    line.replayed.pop_front();
    ++equal_replies_;
  }
}

void Replay::differ(Line& line) {
  if (difference_) return;
  difference_ = Difference{line.interface,
                           front(line.recorded),
                           front(line.replayed),
                           {line.before.begin(), line.before.end()}};
}

void Replay::note(Line& line, const ReplayedFrame& frame) {
  if (line.before.size() == kContext) line.before.pop_front();
  line.before.push_back(frame);
}

namespace {

std::string instant(SimTime at) {
  const auto us = std::chrono::floor<std::chrono::microseconds>(at).count();
  return fmt::format("{}.{:06} s", us / 1'000'000, us % 1'000'000);
}

/// Returns the drive and the decoded values of its frame; empty if it cannot be decoded.
std::string meaning(const protocol::Frame& frame, const BusConfig& bus) {
  for (const ServoConfig& servo : bus.servos) {
    const std::string text = values_text(ReplyReader(servo).values(frame));
    if (!text.empty()) return fmt::format("  drive {}: {}", servo.id, text);
  }
  return "";
}

std::string line(const char* what, const std::optional<TimedFrame>& reply, const BusConfig& bus) {
  if (!reply) return fmt::format("  {}  nothing\n", what);
  return fmt::format("  {}  {}  {}{}\n", what, instant(reply->at), frame_text(reply->frame),
                     meaning(reply->frame, bus));
}

}  // namespace

std::string difference_text(const Difference& difference, const BusConfig& bus,
                            const RecordingInfo& recording) {
  std::string text;
  if (recording.version != LKEMU_VERSION) {
    text = fmt::format("made by {}, the model differs: this is {}\n", recording.version,
                       LKEMU_VERSION);
  }
  const auto& first = difference.recorded ? difference.recorded : difference.replayed;
  text += fmt::format(
      "first difference on {} at {}:\n", difference.bus,
      instant(std::min(first->at, difference.replayed ? difference.replayed->at : first->at)));
  text += line("recorded", difference.recorded, bus);
  text += line("replayed", difference.replayed, bus);
  if (!difference.before.empty()) text += "before it:\n";
  for (const ReplayedFrame& frame : difference.before) {
    text += fmt::format("  {}  {}  {} {}\n", frame.from_host ? "host    " : "drive   ",
                        instant(frame.timed.at), frame_text(frame.timed.frame),
                        frame.from_host ? "" : meaning(frame.timed.frame, bus));
  }
  return text;
}

namespace {

/// Samples one bus.
struct BusSampler {
  CsvFile& file;
  std::size_t n;

  SimTime next_due() const { return file.next_due(n); }
  void sample(const Bus& bus) { file.sample(n, bus); }
};

}  // namespace

ReplayCsvFile::ReplayCsvFile(const ReplayCsv& csv, const std::vector<BusConfig>& buses,
                             Replay& replay)
    : file_(csv.file, buses, csv.signals, {}, csv.period) {
  replay.advance = [this, &replay](std::size_t n, SimTime until) {
    BusSampler sampler{file_, n};
    advance_watched(replay.bus(n), until, sampler);
  };
}

namespace {

/// Lines between two calls of `progress`.
constexpr int kLinesBetweenReports = 4096;

/// In bytes; longer than the line of any frame.
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
  /// Reads the next line. Returns false at the end of the file, or if the line has no newline.
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
  /// Performs the remaining inputs. In a truncated recording, skips inputs that are not before the
  /// last frame of their bus.
  void finish() {
    const bool all = complete();
    for (; next_ != recording_.inputs.end() && !replay_.difference(); ++next_) {
      if (all || (next_->after_frames <= replay_.host_frames() &&
                  next_->at < replay_.last(bus_of(*next_)))) {
        perform(*next_);
      }
    }
  }
  /// Returns true if the recording has the end of each bus.
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
    if (!replay_.advance_to(bus, input.at)) return;
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
    const toml::table table = parse_json_table(request.json);
    TableReader reader(table, kInputsFile, "");
    reader.text("bus");
    for (const TimedDirective& one : read_directives(reader, config, Timing::kOptional, &bus)) {
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
  if (line.direction == CandumpLine::Direction::kUnknown) {
    lines.fail("the frame must be followed by T (from a host) or R (from a drive)");
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
