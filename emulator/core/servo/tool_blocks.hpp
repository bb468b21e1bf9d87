#pragma once

/// @file What the vendor's PC tool reads and writes as blocks over RS-485, and what a drive says it
/// is: bytes at the offsets of docs/rs485.md.

#include <cstdint>

#include "emulator/core/bus_config.hpp"
#include "protocol/replies.hpp"

namespace lk::emulator {

/// 0x12: 58 bytes, or the 42 of the oldest manual.
protocol::Block product_block(const ServoConfig& config);
/// 0x1F.
std::uint16_t device_type(Series series);
/// 0x14: `ram` as the tool shows it.
protocol::Block settings_block(const ServoConfig& config, const Registers& ram,
                               const protocol::WireFormat& format);
/// 0x15: what of `block` the registers hold; what they cannot is clamped. The ID, the buses and the
/// inputs of the block stay as they are.
void take_settings_block(const protocol::Payload& request, const protocol::WireFormat& format,
                         Registers& ram);
/// 0x16: as aligned by the vendor.
protocol::Block calibration_block(const ServoConfig& config, const Registers& ram);

}  // namespace lk::emulator
