#pragma once

/// @file Bit rates of RS-485 and CAN, and the table `rs485` of a configuration file.

#include <cstdint>
#include <string>
#include <vector>

#include "emulator/config/config_reader.hpp"
#include "emulator/core/bus_config.hpp"

namespace lk::emulator {

inline constexpr std::int64_t kDefaultBaud = 115'200;

/// Returns why `baud` is invalid for RS-485; empty if valid: 0, or a rate that drives have.
std::string baud_problem(std::int64_t baud);
/// Returns the code that the vendor's tool uses for `baud`; kAsWired for 0, which allows any rate.
/// If the tool does not have 921600 bit/s (`has_921600`), codes of higher rates are lower by one.
std::uint8_t rate_code(std::int64_t baud, bool has_921600);
/// Returns the code of the nearest CAN bit rate; kAsWired for 0.
std::uint8_t can_rate_code(std::int64_t bitrate);
/// Return the bit rate of a code, bit/s; 0 if the code is unknown.
std::int64_t serial_rate_of(std::uint8_t code, bool has_921600);
std::int64_t can_rate_of(std::uint8_t code);

/// Reads the table `rs485` of a bus; defaults if absent.
SerialConfig read_serial(TableReader& bus, const std::string& interface);

}  // namespace lk::emulator
