#pragma once

/// @file A bus of RS-485: its bit rates, and the table `rs485` of a configuration file.

#include <cstdint>
#include <string>

#include "emulator/config/config_reader.hpp"
#include "emulator/core/bus_config.hpp"

namespace lk::emulator {

inline constexpr std::int64_t kDefaultBaud = 115'200;

/// Why `baud` cannot be the bit rate of RS-485; empty when it can: 0, or one that drives have.
std::string baud_problem(std::int64_t baud);
/// The number that the vendor's tool has for a rate; kAsWired for 0, with which any rate will do.
/// Without `has_921600`, higher rates have numbers lower by one.
std::uint8_t rate_code(std::int64_t baud, bool has_921600);
/// The number of the nearest CAN rate.
std::uint8_t can_rate_code(std::int64_t bitrate);
/// The rates of these numbers; 0: there is none.
std::int64_t serial_rate_of(std::uint8_t code, bool has_921600);
std::int64_t can_rate_of(std::uint8_t code);

/// What the table `rs485` of a bus says, if there is one.
SerialConfig read_serial(TableReader& bus, const std::string& interface);

}  // namespace lk::emulator
