#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "emulator/core/scenario/sampler.hpp"

namespace lk::emulator {

/// Returns "time_s,1.speed_dps,body.fallen,…"; with several buses, the bus precedes the ID.
std::string csv_header(const std::vector<std::string>& buses, const std::vector<Sampler>& samplers);
/// Returns a line: time in nanoseconds, and the shortest numbers that parse to the same bits.
std::string csv_row(SimTime time, const std::vector<double>& values);

}  // namespace lk::emulator
