#pragma once

/// @file Blocks that the vendor's PC tool reads and writes over RS-485, and product data: bytes at
/// the offsets of docs/reference/rs485.md.

#include <cstdint>

#include "emulator/core/bus_config.hpp"
#include "protocol/replies.hpp"

namespace lk::emulator {

/// 0x12: 58 bytes, or 42 in the oldest manual.
protocol::Block product_block(const ServoConfig& config);
/// 0x1F: code of the drive series.
std::uint16_t device_type(Series series);
/// 0x14: the settings in `ram`, in the layout of the tool.
protocol::Block settings_block(const ServoConfig& config, const Registers& ram,
                               const protocol::WireFormat& format);
/// 0x15: sets the registers from `request`, and clamps values out of range. Ignores ID, bus, bit
/// rates, inputs and protections in the block.
void take_settings_block(const protocol::Payload& request, const protocol::WireFormat& format,
                         Registers& ram);
/// 0x16: calibration data as set by the vendor.
protocol::Block calibration_block(const ServoConfig& config, const Registers& ram);

}  // namespace lk::emulator
