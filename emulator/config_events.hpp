#pragma once

#include "emulator/bus_config.hpp"
#include "emulator/config_reader.hpp"

namespace lk::emulator {

/// Reads every [[bus.event]] into `bus.events`, one directive a drive, by time. The bus must have
/// its drives.
void read_events(TableReader& reader, BusConfig& bus);

}  // namespace lk::emulator
