#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "emulator/core/rom_write.hpp"
#include "emulator/core/sim_time.hpp"
#include "emulator/record/log_writer.hpp"
#include "emulator/record/recording.hpp"

namespace lk::emulator {

/// What a recording is to be of.
struct RecordRequest {
  std::filesystem::path directory;
  Overrides overrides;
  ConfigTexts texts;
  std::string clock = "realtime";
};

/// recording.json of a recording that begins now, on the calendar, at `start` of simulated time.
RecordingInfo recording_info(const RecordRequest& request, SimTime start);

/// Writes a recording (docs/record.md) as it happens. Calls come in the order in which things reach
/// the buses and never wait for the disk. When that refuses, the recording ends with one line in
/// the log, and everything else goes on.
class Recorder {
 public:
  /// `buses` are as the drives start, or started. Throws StartError.
  Recorder(std::filesystem::path directory, const RecordingInfo& info, const ConfigTexts& texts,
           std::vector<BusConfig> buses);

  const std::filesystem::path& directory() const { return directory_; }
  /// The disk has refused.
  bool failed() const { return writer_->failed(); }

  // `bus` is the place among the buses.
  /// A host's frame, as the bus is given it: `at` in whole microseconds, the bus brought there, its
  /// replies recorded.
  void host_frame(std::size_t bus, SimTime at, const protocol::Frame& frame);
  /// A frame of a drive has left the wire.
  void reply(std::size_t bus, const TimedFrame& reply);
  /// A directive was applied or planned; `json` is the object that asked for it.
  void directive(std::size_t bus, SimTime at, std::string json);
  /// The disk refused what a drive wrote: its ROM holds this again.
  void restored_rom(std::size_t bus, SimTime at, int id, const Registers& rom, const RomWear& wear);
  /// Nothing more will come; the buses have got as far as `times`.
  void end(const std::vector<SimTime>& times);
  /// That is on the disk, or will not be.
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
