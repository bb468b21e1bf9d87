#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>

#include "emulator/record/recording.hpp"
#include "emulator/record/replay.hpp"

namespace lk::emulator {

/// How a replay ended.
struct ReplayEnd {
  bool complete = false;  // the recording was ended properly, not cut off
  bool cut_line = false;  // cut off inside a line, which is ignored
  SimTime until{0};       // simulated time of the last entry
};

/// Runs `replay`, made from `recording.buses`, with the recording in `directory`, to its end or the
/// first difference. Calls `progress` from time to time. Throws StartError if a file cannot be
/// read.
ReplayEnd replay_recording(const std::filesystem::path& directory, const Recording& recording,
                           Replay& replay, const std::function<void(SimTime)>& progress = {});

}  // namespace lk::emulator
