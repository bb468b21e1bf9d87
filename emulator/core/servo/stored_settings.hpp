#pragma once

/// @file Settings of 0x40 and 0x42 on CAN: their registers, and their parameters in ROM.

#include <functional>
#include <vector>

#include "emulator/core/bus_config.hpp"
#include "emulator/core/parameter_memory.hpp"
#include "protocol/parameters.hpp"

namespace lk::emulator {

/// Address of a drive: ID, bus and bit rates.
struct DriveAddress {
  int id = 0;  // 1..32
  protocol::BusType bus = protocol::BusType::kCan;
  std::uint8_t serial_rate = 0;  // rates are codes (Registers)
  std::uint8_t can_rate = 0;

  friend bool operator==(const DriveAddress&, const DriveAddress&) = default;
};

/// Returns the address in the registers. Wiring and configuration replace entries of kAsWired.
DriveAddress drive_address(const Registers& registers, const ServoConfig& config);

/// Returns true if the drive is set to the bus that it is wired to.
bool is_on_its_bus(const DriveAddress& address, const ServoConfig& config);
/// Returns true if the drive is set to the bit rate of the bus that it is wired to.
bool is_at_its_rate(const DriveAddress& address, const ServoConfig& config);

/// Returns the configured IDs of the other drives that answer at the same address as the drive
/// `id`. `address_of` returns the address of a drive.
using AddressOf = std::function<DriveAddress(const ServoConfig&)>;
std::vector<int> sharing_drives(const BusConfig& bus, int id, const AddressOf& address_of);

/// Returns the setting `which` with its value from the registers. Pre: the setting exists.
protocol::StoredSetting get_stored(const Registers& registers, const protocol::StoredSetting& which,
                                   const ServoConfig& config, const protocol::WireFormat& format);
/// Writes a setting to the registers. Pre: its value is in range, or is what get_stored returns.
void set_stored(Registers& registers, const protocol::StoredSetting& setting,
                const ServoConfig& config, const protocol::WireFormat& format);
RomParameter rom_parameter_of(protocol::StoredSettingId id, Series series);

}  // namespace lk::emulator
