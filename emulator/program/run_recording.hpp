#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "emulator/control/control_api.hpp"
#include "emulator/live/world.hpp"
#include "emulator/record/recorder.hpp"

namespace lk::emulator {

/// Records what happens on the lines of a world, from any time on; one recording at a time.
class RunRecording {
 public:
  /// `overrides` and `texts` are what the buses of `world` were made of.
  RunRecording(World& world, Overrides overrides, ConfigTexts texts)
      : world_(world), overrides_(std::move(overrides)), texts_(std::move(texts)) {}
  RunRecording(const RunRecording&) = delete;
  RunRecording& operator=(const RunRecording&) = delete;
  ~RunRecording() { stop(); }

  /// Begins. Only what holds a run from its beginning can be run again. Throws StartError.
  enum class From : std::uint8_t { kBeginning, kNow };
  void start(const std::filesystem::path& directory, From from);
  /// Ends, and does not wait for the disk.
  void stop();
  bool running() const { return !listeners_.empty(); }
  /// Of the recording that runs, or ran last.
  const std::optional<Recorder>& recorder() const { return recorder_; }
  /// What the control interface calls.
  Activity for_clients();
  /// Nothing is left to write.
  bool done() const {
    return (!recorder_ || recorder_->done()) && (!previous_ || previous_->done());
  }

 private:
  Json state() const;

  World& world_;
  Overrides overrides_;
  ConfigTexts texts_;
  std::optional<Recorder> recorder_;
  std::optional<Recorder> previous_;  // its last lines may be on their way to the disk
  bool replayable_ = false;
  std::vector<Line::ListenerKey> listeners_;  // by line
};

}  // namespace lk::emulator
