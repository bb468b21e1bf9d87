#pragma once

#include <string>
#include <vector>

#include "emulator/core/servo/signals.hpp"
#include "emulator/core/sim_time.hpp"

namespace lk::emulator {

/// What --signals names. Throws StartError.
std::vector<const Signal*> find_signals(const std::vector<std::string>& names);

/// The time between rows at --rate. Throws StartError.
SimTime row_period(double rate_Hz);

}  // namespace lk::emulator
