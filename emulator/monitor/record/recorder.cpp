#include "emulator/monitor/record/recorder.hpp"

#include <fcntl.h>
#include <fmt/chrono.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <ctime>
#include <system_error>
#include <utility>

#include "emulator/config/candump_log.hpp"
#include "emulator/core/start_error.hpp"
#include "emulator/files/durable_file.hpp"

namespace lk::emulator {
namespace {

/// Time to collect lines for one write: a write per frame would cost more than the frame itself.
constexpr auto kGather = std::chrono::milliseconds(10);

}  // namespace

LogWriter::LogWriter(std::array<Descriptor, kFiles> files, OnEnd on_end, std::size_t most_waiting)
    : files_(std::move(files)), on_end_(std::move(on_end)), most_waiting_(most_waiting) {
  const SignalsBlocked blocked;
  thread_ = std::thread([this] { run(); });
}

LogWriter::~LogWriter() {
  finish("");
  thread_.join();
}

void LogWriter::finish(std::string last_lines) {
  {
    const std::lock_guard lock(mutex_);
    if (stop_) return;
    stop_ = true;
    last_lines_ = std::move(last_lines);
  }
  changed_.notify_one();
}

void LogWriter::add(std::size_t log, std::string_view line) {
  bool too_slow = false;
  bool first = false;
  {
    const std::lock_guard lock(mutex_);
    if (failed_ || stop_) return;
    too_slow = failed_ = waiting_bytes_ + line.size() >= most_waiting_;
    if (!too_slow) {
      first = waiting_bytes_ == 0;
      waiting_bytes_ += line.size() + 1;
      waiting_[log].append(line) += '\n';
    }
  }
  if (first) changed_.notify_one();
  if (too_slow) on_end_("the disk is too slow");
}

void LogWriter::run() {
  bool refused = false;  // a write failed, so nothing more is written
  std::unique_lock lock(mutex_);
  while (!done_) {
    changed_.wait(lock, [this] { return stop_ || waiting_bytes_ > 0; });
    changed_.wait_for(lock, kGather, [this] { return stop_; });
    const bool last = stop_;
    const auto batch = std::exchange(waiting_, {});
    waiting_bytes_ = 0;
    const bool whole = !failed_;
    lock.unlock();
    int error = 0;
    for (std::size_t n = 0; n < kFiles && error == 0 && !refused; ++n) {
      error = write_all(files_[n].get(), batch[n]);
    }
    if (error == 0 && last && whole) error = write_all(files_[0].get(), last_lines_);
    refused = refused || error != 0;
    lock.lock();
    if (error != 0 && !failed_.exchange(true)) {
      lock.unlock();
      on_end_(std::generic_category().message(error));
      lock.lock();
    }
    done_ = last;
  }
}

namespace {

Descriptor open_log(const std::filesystem::path& file) {
  Descriptor log(::open(file.c_str(), O_WRONLY | O_APPEND | O_NOFOLLOW | O_CLOEXEC));
  if (!log) {
    throw StartError("cannot write " + file.string() + ": " +
                     std::generic_category().message(errno));
  }
  return log;
}

}  // namespace

RecordingInfo recording_info(const RecordRequest& request, SimTime start) {
  RecordingInfo info;
  info.version = LKEMU_VERSION;
  info.replayable = start == SimTime{0};
  info.overrides = request.overrides;
  info.clock = request.clock;
  info.start = start;
  info.started_utc = fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)));
  return info;
}

Recorder::Recorder(std::filesystem::path directory, const RecordingInfo& info,
                   const ConfigTexts& texts, std::vector<BusConfig> buses)
    : directory_(std::move(directory)), buses_(std::move(buses)) {
  if (directory_.extension() == ".mcap") {
    throw StartError("cannot record in " + directory_.string() +
                     ": record into a directory, then run python3 -m lkemu.mcap DIRECTORY");
  }
  begin_recording(directory_, info, texts, buses_, [this] { start_writer(); });
}

void Recorder::start_writer() {
  std::array files{open_log(directory_ / kInputsFile), open_log(directory_ / kFramesFile)};
  try {
    writer_ = std::make_unique<LogWriter>(
        std::move(files), [where = directory_.string()](const std::string& reason) {
          spdlog::error("recording in {} has ended: {}", where, reason);
        });
  } catch (const std::system_error& problem) {  // no thread available
    throw StartError("cannot record in " + directory_.string() + ": " + problem.code().message());
  }
}

void Recorder::host_frame(std::size_t bus, SimTime at, const protocol::Frame& frame) {
  ++host_frames_;
  writer_->add(kFrames,
               candump_line(at, buses_[bus].interface, frame, CandumpLine::Direction::kSent));
}

void Recorder::reply(std::size_t bus, const TimedFrame& reply) {
  writer_->add(kFrames, candump_line(reply.at, buses_[bus].interface, reply.frame,
                                     CandumpLine::Direction::kReceived));
}

void Recorder::directive(std::size_t bus, SimTime at, std::string json) {
  writer_->add(kInputs, input_line(bus, at, RecordedInput::Request{std::move(json)}));
}

void Recorder::restored_rom(std::size_t bus, SimTime at, int id, const Registers& rom,
                            const RomWear& wear) {
  const auto servo = std::ranges::find(buses_[bus].servos, id, &ServoConfig::id);
  const auto restored = record_rom(rom, wear, buses_[bus].interface, *servo);
  writer_->add(kInputs, input_line(bus, at, restored));
}

void Recorder::end(const std::vector<SimTime>& times) {
  std::string lines;
  for (std::size_t bus = 0; bus < times.size(); ++bus) {
    lines += input_line(bus, times[bus], RecordedInput::End{}) + '\n';
  }
  writer_->finish(std::move(lines));
}

std::string Recorder::input_line(std::size_t bus, SimTime at,
                                 decltype(RecordedInput::what) what) const {
  return print_input({at, host_frames_, buses_[bus].interface, std::move(what)});
}

}  // namespace lk::emulator
