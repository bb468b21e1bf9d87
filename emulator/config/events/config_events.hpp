#pragma once

#include "emulator/config/config_reader.hpp"
#include "emulator/core/bus_config.hpp"

namespace lk::emulator {

/// Reads every [[bus.event]] into `bus.events`: one directive per drive, ordered by time. Pre: the
/// bus has its drives.
void read_events(TableReader& reader, BusConfig& bus);

}  // namespace lk::emulator
