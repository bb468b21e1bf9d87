#pragma once

#include <string>
#include <vector>

#include "emulator/record/recording.hpp"
#include "emulator/record/replay.hpp"

namespace lk::emulator {

/// Describes a difference for the user: time, both frames decoded, and the frames before. First it
/// warns if another version of lk-emu made the recording. `bus`: configuration of the bus. Has
/// several lines.
std::string difference_text(const Difference& difference, const BusConfig& bus,
                            const RecordingInfo& recording);

}  // namespace lk::emulator
