#pragma once

#include <string>
#include <vector>

#include "emulator/record/replay.hpp"

namespace lk::emulator {

/// What a difference looks like to a person: when and what, both frames with what they say, and
/// what went before. `bus` is the configuration of its bus. Several lines.
std::string difference_text(const Difference& difference, const BusConfig& bus);

}  // namespace lk::emulator
