#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>

#include "emulator/record/recording.hpp"
#include "emulator/record/replay.hpp"

namespace lk::emulator {

/// How a replay came to its end.
struct ReplayEnd {
  bool complete = false;  // the recording was ended in good order; else it breaks off
  bool cut_line = false;  // and in the midst of a line, which does not count
  SimTime until{0};       // simulated time of the recording's last word
};

/// Runs `replay`, made of `recording.buses`, on what `directory` has, to its end or to the first
/// difference. `progress` hears now and then where it is. Throws
/// StartError when they cannot be read.
ReplayEnd replay_recording(const std::filesystem::path& directory, const Recording& recording,
                           Replay& replay, const std::function<void(SimTime)>& progress = {});

}  // namespace lk::emulator
