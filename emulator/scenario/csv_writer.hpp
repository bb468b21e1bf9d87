#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "emulator/core/scenario/sampler.hpp"

namespace lk::emulator {

/// "time_s,1.speed_dps,body.fallen,…"; with the bus before the ID when there are several.
std::string csv_header(const std::vector<std::string>& buses, const std::vector<Sampler>& samplers);
/// A line: the time to the nanosecond, numbers as short as they come back to the same bits.
std::string csv_row(SimTime time, const std::vector<double>& values);

}  // namespace lk::emulator
