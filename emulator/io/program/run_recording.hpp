#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "emulator/io/control/control_api.hpp"
#include "emulator/io/live/world.hpp"
#include "emulator/monitor/record/recorder.hpp"

namespace lk::emulator {

/// Records the traffic of a world's lines; one recording at a time, which can start at any time.
class RunRecording {
 public:
  /// `overrides` and `texts`: configuration of the buses of `world`, to be stored with recordings.
  RunRecording(World& world, Overrides overrides, ConfigTexts texts)
      : world_(world), overrides_(std::move(overrides)), texts_(std::move(texts)) {}
  RunRecording(const RunRecording&) = delete;
  RunRecording& operator=(const RunRecording&) = delete;
  ~RunRecording() { stop(); }

  /// Starts a recording. It can be replayed only if it is from the beginning, and the robot has
  /// no body. Throws StartError.
  enum class From : std::uint8_t { kBeginning, kNow };
  void start(const std::filesystem::path& directory, From from);
  /// Ends the recording without waiting for the disk.
  void stop();
  bool running() const { return !listeners_.empty(); }
  /// Returns the present or last recording; nullopt before the first.
  const std::optional<Recorder>& recorder() const { return recorder_; }
  /// Returns functions for the control interface.
  Activity for_clients();
  /// Returns true if all recordings are completely written.
  bool done() const {
    return (!recorder_ || recorder_->done()) && (!previous_ || previous_->done());
  }

 private:
  Json state() const;

  World& world_;
  Overrides overrides_;
  ConfigTexts texts_;
  std::optional<Recorder> recorder_;
  std::optional<Recorder> previous_;  // the one before; its last lines may still be unwritten
  bool replayable_ = false;
  std::vector<Line::ListenerKey> listeners_;  // by line
};

}  // namespace lk::emulator
