#pragma once

/// @file RS-485 buses: bit rates, and the table `rs485` of a configuration file.

#include <cstdint>
#include <string>
#include <vector>

#include "emulator/config/config_reader.hpp"
#include "emulator/core/bus_config.hpp"

namespace lk::emulator {

inline constexpr std::int64_t kDefaultBaud = 115'200;

/// Returns why `baud` is invalid for RS-485; empty if valid: 0, or a rate that drives have.
std::string baud_problem(std::int64_t baud);
/// Returns the code of a rate in the vendor's tool; kAsWired for 0, which allows any rate. Without
/// `has_921600`, the codes of higher rates are lower by one.
std::uint8_t rate_code(std::int64_t baud, bool has_921600);
/// Returns the code of the nearest CAN rate.
std::uint8_t can_rate_code(std::int64_t bitrate);
/// Return the rate of a code; 0 if there is none.
std::int64_t serial_rate_of(std::uint8_t code, bool has_921600);
std::int64_t can_rate_of(std::uint8_t code);

/// Reads the table `rs485` of a bus; defaults if absent.
SerialConfig read_serial(TableReader& bus, const std::string& interface);

}  // namespace lk::emulator
