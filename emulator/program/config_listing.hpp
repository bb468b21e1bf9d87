#pragma once

#include <string>
#include <vector>

#include "emulator/core/bus_config.hpp"
#include "emulator/core/servo/stored_settings.hpp"

namespace lk::emulator {

/// Where a drive is found, if not where it is wired and configured: "answers at ID 9, as drive 2
/// does"; else empty. `place_of` returns where a drive of `bus` is found.
std::string place_note(const ServoConfig& servo, const BusConfig& bus, const PlaceOf& place_of);

/// What would run, as a table for a person (`lk-emu --check`): one line a drive, then what is
/// allowed and yet looks like a mistake.
std::string describe_run(const std::vector<BusConfig>& buses);

/// How the drives of a bus speak, a line for all that speak alike: "vcan0:1,2: legacy: 0x9A voltage
/// 0.1 V in bytes 3-4, …".
std::vector<std::string> spoken(const BusConfig& bus);

/// A line for each kind of motor that speaks `legacy`, as nothing else was asked for, and was seen
/// to speak otherwise.
std::vector<std::string> seen_otherwise(const std::vector<BusConfig>& buses);

}  // namespace lk::emulator
