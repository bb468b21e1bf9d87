#pragma once

#include <array>
#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "emulator/core/rom_write.hpp"
#include "emulator/core/sim_time.hpp"
#include "emulator/files/durable_file.hpp"
#include "emulator/monitor/record/recording.hpp"

namespace lk::emulator {

/// Writes the lines of two logs on its own thread, so that callers never wait for the disk. Lines
/// of the first log are written before later lines of the second, also if the process is killed.
class LogWriter {
 public:
  /// Limit of unwritten bytes: about 300 000 frames, half a minute of a full bus.
  static constexpr std::size_t kMaxWaiting = std::size_t{16} << 20U;

  /// Called at most once, on any thread, with the reason why nothing more is written.
  using OnEnd = std::function<void(const std::string& reason)>;

  static constexpr std::size_t kFiles = 2;

  LogWriter(std::array<Descriptor, kFiles> files, OnEnd on_end,
            std::size_t most_waiting = kMaxWaiting);
  LogWriter(const LogWriter&) = delete;
  LogWriter& operator=(const LogWriter&) = delete;
  /// Waits until everything is written or has failed.
  ~LogWriter();

  /// Ends the logs without waiting for the disk. Appends `last_lines` to the first log, after the
  /// lines added before.
  void finish(std::string last_lines);
  /// Returns true after finish(), once everything is written or has failed.
  bool done() const { return done_; }

  /// Adds a line, given without its newline. Never waits for the disk.
  void add(std::size_t log, std::string_view line);
  /// Returns true after a write error, or if more than the limit was unwritten.
  bool failed() const { return failed_; }

 private:
  using Batch = std::array<std::string, kFiles>;  // lines of each log, with newlines

  void run();

  std::array<Descriptor, kFiles> files_;
  OnEnd on_end_;
  std::size_t most_waiting_;
  std::mutex mutex_;  // protects the members below; failed_ and done_ can be read without it
  std::condition_variable changed_;
  Batch waiting_;
  std::size_t waiting_bytes_ = 0;
  std::atomic<bool> failed_ = false;
  bool stop_ = false;
  std::atomic<bool> done_ = false;
  std::string last_lines_;
  std::thread thread_;
};

/// Settings of a recording.
struct RecordRequest {
  std::filesystem::path directory;
  Overrides overrides;
  ConfigTexts texts;
  std::string clock = "realtime";
};

/// Makes recording.json for a recording that begins now, at simulated time `start`.
RecordingInfo recording_info(const RecordRequest& request, SimTime start);

/// Writes a recording (docs/reference/formats.md). Calls come in the order of events on the buses
/// and never wait for the disk. If the disk fails, the recording ends with one log line; the
/// emulator continues.
class Recorder {
 public:
  /// `buses`: configuration with which the drives start or have started. Throws StartError.
  Recorder(std::filesystem::path directory, const RecordingInfo& info, const ConfigTexts& texts,
           std::vector<BusConfig> buses);

  const std::filesystem::path& directory() const { return directory_; }
  /// Returns true if the disk failed or was too slow, which ended the recording.
  bool failed() const { return writer_->failed(); }

  // `bus` is an index into the buses.
  /// Records a host's frame as given to the bus. Pre: `at` is in whole microseconds; the bus has
  /// reached `at`; all replies up to then are recorded.
  void host_frame(std::size_t bus, SimTime at, const protocol::Frame& frame);
  /// Records a drive's frame whose transmission on the wire has ended.
  void reply(std::size_t bus, const TimedFrame& reply);
  /// Records a directive that was applied or planned; `json` is the request.
  void directive(std::size_t bus, SimTime at, std::string json);
  /// Records that a ROM write failed on the disk, so that the ROM holds `rom` and `wear` again.
  void restored_rom(std::size_t bus, SimTime at, int id, const Registers& rom, const RomWear& wear);
  /// Ends the recording. `times`: time of each bus.
  void end(const std::vector<SimTime>& times);
  /// Returns true once the end is written or has failed.
  bool done() const { return writer_->done(); }

 private:
  void start_writer();
  std::string input_line(std::size_t bus, SimTime at, decltype(RecordedInput::what) what) const;

  std::filesystem::path directory_;
  std::vector<BusConfig> buses_;
  std::uint64_t host_frames_ = 0;
  std::unique_ptr<LogWriter> writer_;
};

}  // namespace lk::emulator
