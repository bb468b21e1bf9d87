#pragma once

#include <string>
#include <vector>

#include "emulator/core/bus_config.hpp"

namespace lk::emulator {

/// What would run, as a table for a person (`lk-emu --check`): one line a drive, then what is
/// allowed and yet looks like a mistake.
std::string describe_run(const std::vector<BusConfig>& buses);

}  // namespace lk::emulator
