#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "emulator/core/bus_config.hpp"
#include "emulator/core/scenario/sampler.hpp"
#include "emulator/core/servo/signals.hpp"
#include "emulator/core/sim_time.hpp"

namespace lk::emulator {

/// Finds signals of drives and of the body, which may be null. Throws StartError.
std::vector<const Signal*> find_signals(const std::vector<std::string>& names,
                                        const BodySignals* body);

/// Returns the columns by bus: signals of each drive among `ids` (empty: all). The body's signals
/// are with the first bus.
std::vector<std::vector<SampledColumn>> csv_columns(const std::vector<BusConfig>& buses,
                                                    const std::vector<const Signal*>& signals,
                                                    const std::vector<int>& ids);

/// Returns the time between rows at --rate. Throws StartError.
SimTime row_period(double rate_Hz);

/// Returns "time_s,1.speed_dps,body.fallen,…"; with several buses, the bus precedes the ID.
std::string csv_header(const std::vector<std::string>& buses, const std::vector<Sampler>& samplers);
/// Returns a line: time in nanoseconds, and the shortest numbers that parse to the same bits.
std::string csv_row(SimTime time, const std::vector<double>& values);

}  // namespace lk::emulator
