#pragma once

#include <string>
#include <vector>

#include "emulator/core/bus_config.hpp"
#include "emulator/core/scenario/sampler.hpp"
#include "emulator/core/servo/body_signals.hpp"
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

}  // namespace lk::emulator
