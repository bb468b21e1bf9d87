#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "emulator/io/control/control_api.hpp"
#include "emulator/io/live/world.hpp"
#include "emulator/monitor/record/recorder.hpp"

namespace lk::emulator {

/// Records the lines of a world, from any time on; one recording at a time.
class RunRecording {
 public:
  /// `overrides` and `texts`: sources of the buses of `world`.
  RunRecording(World& world, Overrides overrides, ConfigTexts texts)
      : world_(world), overrides_(std::move(overrides)), texts_(std::move(texts)) {}
  RunRecording(const RunRecording&) = delete;
  RunRecording& operator=(const RunRecording&) = delete;
  ~RunRecording() { stop(); }

  /// Starts a recording. Only one from the beginning can be replayed. Throws StartError.
  enum class From : std::uint8_t { kBeginning, kNow };
  void start(const std::filesystem::path& directory, From from);
  /// Ends the recording without waiting for the disk.
  void stop();
  bool running() const { return !listeners_.empty(); }
  /// Present or last recording.
  const std::optional<Recorder>& recorder() const { return recorder_; }
  /// Functions for the control interface.
  Activity for_clients();
  /// Returns true if everything is written.
  bool done() const {
    return (!recorder_ || recorder_->done()) && (!previous_ || previous_->done());
  }

 private:
  Json state() const;

  World& world_;
  Overrides overrides_;
  ConfigTexts texts_;
  std::optional<Recorder> recorder_;
  std::optional<Recorder> previous_;  // may still write its last lines
  bool replayable_ = false;
  std::vector<Line::ListenerKey> listeners_;  // by line
};

}  // namespace lk::emulator
