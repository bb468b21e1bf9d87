#pragma once

/// @file The settings of 0x40 and 0x42 on CAN: what they are in the registers, and where ROM keeps
/// them.

#include <functional>
#include <vector>

#include "emulator/core/bus_config.hpp"
#include "emulator/core/parameter_memory.hpp"
#include "protocol/parameters.hpp"

namespace lk::emulator {

/// Where a drive is found.
struct DrivePlace {
  int id = 0;  // 1..32
  protocol::BusType bus = protocol::BusType::kCan;
  std::uint8_t serial_rate = 0;  // codes
  std::uint8_t can_rate = 0;

  friend bool operator==(const DrivePlace&, const DrivePlace&) = default;
};

/// What the registers say of it, and where they do not, how the drive is wired.
DrivePlace drive_place(const Registers& registers, const ServoConfig& config);

/// Does the drive hear the bus that it is wired to, at the rate of that bus?
bool is_on_its_bus(const DrivePlace& place, const ServoConfig& config);
bool is_at_its_rate(const DrivePlace& place, const ServoConfig& config);

/// Configured IDs of the other drives that answer at the same ID as drive `id`. `place_of` returns
/// where a drive is found.
using PlaceOf = std::function<DrivePlace(const ServoConfig&)>;
std::vector<int> sharing_drives(const BusConfig& bus, int id, const PlaceOf& place_of);

/// The setting, one that there is, as the registers have it.
protocol::StoredSetting get_stored(const Registers& registers, const protocol::StoredSetting& which,
                                   const ServoConfig& config, const protocol::WireFormat& format);
/// The registers have it; its value is within its range, or what get_stored gives.
void set_stored(Registers& registers, const protocol::StoredSetting& setting,
                const ServoConfig& config, const protocol::WireFormat& format);
RomParameter rom_parameter_of(protocol::StoredSettingId id, Series series);

}  // namespace lk::emulator
