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

/// Settings of a recording.
struct RecordRequest {
  std::filesystem::path directory;
  Overrides overrides;
  ConfigTexts texts;
  std::string clock = "realtime";
};

/// Makes recording.json for a recording that begins now, at simulated time `start`.
RecordingInfo recording_info(const RecordRequest& request, SimTime start);

/// Writes a recording (docs/record.md). Calls come in the order of events on the buses and never
/// wait for the disk. If the disk fails, the recording ends with one log line; the emulator
/// continues.
class Recorder {
 public:
  /// `buses` are as the drives start, or started. Throws StartError.
  Recorder(std::filesystem::path directory, const RecordingInfo& info, const ConfigTexts& texts,
           std::vector<BusConfig> buses);

  const std::filesystem::path& directory() const { return directory_; }
  /// The disk has failed.
  bool failed() const { return writer_->failed(); }

  // `bus` is an index into the buses.
  /// Records a host's frame as given to the bus. Pre: `at` is in whole microseconds; the bus has
  /// reached it; earlier replies are recorded.
  void host_frame(std::size_t bus, SimTime at, const protocol::Frame& frame);
  /// Records a drive's frame that has left the wire.
  void reply(std::size_t bus, const TimedFrame& reply);
  /// Records a directive that was applied or planned; `json` is the request.
  void directive(std::size_t bus, SimTime at, std::string json);
  /// Records that the disk refused a ROM write: the ROM holds these values again.
  void restored_rom(std::size_t bus, SimTime at, int id, const Registers& rom, const RomWear& wear);
  /// Ends the recording; the buses have reached `times`.
  void end(const std::vector<SimTime>& times);
  /// The end is on the disk, or has failed.
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
