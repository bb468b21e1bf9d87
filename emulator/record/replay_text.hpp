#pragma once

#include <string>
#include <vector>

#include "emulator/record/recording.hpp"
#include "emulator/record/replay.hpp"

namespace lk::emulator {

/// What a difference looks like to a person: when and what, both frames with what they say, and
/// what went before; first of all, of a recording that another version of the program made, that
/// its model differs. `bus` is the configuration of its bus. Several lines.
std::string difference_text(const Difference& difference, const BusConfig& bus,
                            const RecordingInfo& recording);

}  // namespace lk::emulator
