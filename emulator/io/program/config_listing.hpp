#pragma once

#include <string>
#include <vector>

#include "emulator/core/bus_config.hpp"
#include "emulator/core/servo/stored_settings.hpp"

namespace lk::emulator {

/// Describes a drive's address if it differs from the configuration: "answers at ID 9, as drive 2
/// does", or that the drive is set to another bus or bit rate; otherwise empty. `address_of`
/// returns the address of a drive of `bus`.
std::string place_note(const ServoConfig& servo, const BusConfig& bus, const AddressOf& address_of);

/// Returns a table of the configuration for `lk-emu --check`: one line per drive, then notes on
/// values that are allowed but look like mistakes.
std::string describe_run(const std::vector<BusConfig>& buses);

/// Returns the protocol variants of a bus, one line for all equal drives: "vcan0:1,2: legacy: 0x9A
/// voltage 0.1 V in bytes 3-4, …".
std::vector<std::string> protocol_summary(const BusConfig& bus);

/// Returns one line for each motor that uses the generation `legacy` by default, although real
/// drives of it were seen with another one.
std::vector<std::string> generation_hints(const std::vector<BusConfig>& buses);

}  // namespace lk::emulator
