#include "emulator/core/servo/stored_settings.hpp"

#include <algorithm>
#include <cassert>
#include <iterator>
#include <optional>

#include "emulator/core/servo/registers.hpp"

namespace lk::emulator {

using protocol::BusType;
using protocol::ParameterId;
using protocol::StoredSettingId;

namespace {

// Factory rates: for a bus without a rate, and for the bus type that the drive is not wired to.
constexpr std::uint8_t kSerial115200 = 4;
constexpr std::uint8_t kCanOneMbit = 4;

/// A setting of 0x40: its parameter of 0xC0, or else its address register in `place`.
struct SettingRow {
  StoredSettingId id;
  std::optional<ParameterId> parameter;
  std::uint8_t Registers::*place = nullptr;
  RomParameter rom = RomParameter::kGains;  // only used for an address register
};
constexpr SettingRow kSettingRows[] = {
    {StoredSettingId::kDriverId, {}, &Registers::driver_id, RomParameter::kDriverId},
    {StoredSettingId::kBusType, {}, &Registers::bus_type, RomParameter::kBusType},
    {StoredSettingId::kSerialRate, {}, &Registers::serial_rate, RomParameter::kSerialRate},
    {StoredSettingId::kCanRate, {}, &Registers::can_rate, RomParameter::kCanRate},
    {StoredSettingId::kMaxTorqueCurrent, ParameterId::kMaxTorqueCurrent},
    {StoredSettingId::kMaxSpeed, ParameterId::kMaxSpeed},
    {StoredSettingId::kMaxAngle, ParameterId::kMaxAngle},
    {StoredSettingId::kCurrentRamp, ParameterId::kCurrentRamp},
    {StoredSettingId::kSpeedRamp, ParameterId::kSpeedRamp},
    {StoredSettingId::kAngleGains, ParameterId::kAngleGains},
    {StoredSettingId::kSpeedGains, ParameterId::kSpeedGains},
    {StoredSettingId::kCurrentGains, ParameterId::kCurrentGains},
};

const SettingRow& row_of(StoredSettingId id) {
  const auto* const row = std::ranges::find(kSettingRows, id, &SettingRow::id);
  assert(row != std::end(kSettingRows));
  return *row;
}

BusType wired_to(const ServoConfig& config) {
  return config.quirks.dialect.framing == protocol::Framing::kSerial ? BusType::kSerial
                                                                     : BusType::kCan;
}

}  // namespace

DriveAddress drive_address(const Registers& registers, const ServoConfig& config) {
  const bool serial = wired_to(config) == BusType::kSerial;
  const auto or_wired = [](std::uint8_t setting, std::uint8_t wired) {
    return setting == kAsWired ? wired : setting;
  };
  DriveAddress address;
  address.id = or_wired(registers.driver_id, static_cast<std::uint8_t>(config.id));
  if (address.id == 0) address.id = config.dip_id != 0 ? config.dip_id : config.id;
  address.bus = static_cast<BusType>(
      or_wired(registers.bus_type, static_cast<std::uint8_t>(wired_to(config))));
  const std::uint8_t of_serial = serial ? config.rate_code : kAsWired;
  const std::uint8_t of_can = serial ? kAsWired : config.rate_code;
  address.serial_rate = or_wired(registers.serial_rate, or_wired(of_serial, kSerial115200));
  address.can_rate = or_wired(registers.can_rate, or_wired(of_can, kCanOneMbit));
  return address;
}

bool is_on_its_bus(const DriveAddress& address, const ServoConfig& config) {
  return address.bus == wired_to(config);
}

bool is_at_its_rate(const DriveAddress& address, const ServoConfig& config) {
  const bool serial = wired_to(config) == BusType::kSerial;
  if (config.rate_code == kAsWired) return true;
  return (serial ? address.serial_rate : address.can_rate) == config.rate_code;
}

std::vector<int> sharing_drives(const BusConfig& bus, int id, const AddressOf& address_of) {
  const auto answers_at = [&](const ServoConfig& servo) {
    const DriveAddress address = address_of(servo);
    return is_on_its_bus(address, servo) && is_at_its_rate(address, servo) ? address.id : 0;
  };
  const auto own = std::ranges::find(bus.servos, id, &ServoConfig::id);
  std::vector<int> others;
  if (own == bus.servos.end() || answers_at(*own) == 0) return others;
  for (const ServoConfig& servo : bus.servos) {
    if (servo.id != id && answers_at(servo) == answers_at(*own)) others.push_back(servo.id);
  }
  return others;
}

protocol::StoredSetting get_stored(const Registers& registers, const protocol::StoredSetting& which,
                                   const ServoConfig& config, const protocol::WireFormat& format) {
  protocol::StoredSetting setting{which.table, which.item, {}, 0};
  const SettingRow& row = row_of(which.id());
  if (row.parameter) {
    const protocol::Parameter value = get_parameter(registers, *row.parameter, format);
    setting.gains = value.gains;
    setting.number =
        which.id() == StoredSettingId::kCurrentRamp ? in_16_bits(value.number) : value.number;
    return setting;
  }
  setting.number = registers.*row.place;
  if (setting.number == kAsWired) {
    const DriveAddress address = drive_address(registers, config);
    // In the order of the first rows of kSettingRows.
    const std::int32_t wired[] = {address.id, static_cast<std::int32_t>(address.bus),
                                  address.serial_rate, address.can_rate};
    setting.number = wired[&row - std::begin(kSettingRows)];
  }
  return setting;
}

void set_stored(Registers& registers, const protocol::StoredSetting& setting,
                const ServoConfig& config, const protocol::WireFormat& format) {
  if (setting == get_stored(registers, setting, config, format)) return;
  const SettingRow& row = row_of(setting.id());
  if (row.parameter) {
    set_parameter(registers, {*row.parameter, setting.gains, setting.number}, format);
  } else {
    registers.*row.place = static_cast<std::uint8_t>(setting.number);
  }
}

RomParameter rom_parameter_of(StoredSettingId id, Series series) {
  const SettingRow& row = row_of(id);
  return row.parameter ? rom_parameter_of(*row.parameter, series) : row.rom;
}

}  // namespace lk::emulator
