#pragma once

/// @file Settings of a drive in RAM and ROM, and properties of the ROM.

#include <array>
#include <cstddef>
#include <cstdint>

#include "emulator/core/sim_time.hpp"
#include "model/setpoint.hpp"

namespace lk::emulator {

/// Value of an address setting that was never written: the drive takes the value from its wiring
/// and its configuration.
inline constexpr std::uint8_t kAsWired = 0xFF;

/// Parameter memory of a drive. RAM is a copy of ROM at power-up.
struct Registers {
  model::GainBytes gains;
  std::int32_t acceleration_dps_s = 0;         // 0 = no ramp
  std::uint16_t encoder_offset = 0;            // wire counts
  std::int32_t max_torque_current_lsb = 1000;  // 0..2000, units of the iq command
  std::int32_t max_power_permille = 850;       // 0..850, MS series
  double max_speed_dps = 16800;                // > 0
  double max_angle_deg = 0;                    // 0 = no limit
  double current_ramp_A_s = 0;                 // in the speed and position loops; 0 = no ramp
  bool broadcast_mode = false;                 // answers multi-drive commands only
  std::array<model::Protection, model::kErrorKinds> protections{};  // indexed by model::Error; SI
  std::int32_t align_value = 0;                                     // result of the last 0x18
  // Address settings; each may be kAsWired.
  std::uint8_t driver_id = kAsWired;    // 0..32; 0: the ID on the DIP switch
  std::uint8_t bus_type = kAsWired;     // protocol::BusType
  std::uint8_t serial_rate = kAsWired;  // code of the RS-485 bit rate, 0..10
  std::uint8_t can_rate = kAsWired;     // code of the CAN bit rate, 0..4

  friend bool operator==(const Registers&, const Registers&) = default;
};

/// Parameters in ROM. Each parameter is written separately, and wears separately.
enum class RomParameter : std::uint8_t {
  kGains,
  kAcceleration,
  kEncoderOffset,
  kMaxTorqueCurrent,
  kMaxPower,
  kMaxSpeed,
  kMaxAngle,
  kCurrentRamp,
  kBroadcastMode,
  kProtections,
  kAlignValue,
  kDriverId,
  kBusType,
  kSerialRate,
  kCanRate,
};
inline constexpr std::size_t kRomParameters = 15;
/// Number of writes of each parameter.
using RomWear = std::array<std::uint32_t, kRomParameters>;

/// Properties of the ROM.
struct RomParams {
  SimTime write_time = std::chrono::milliseconds(2);  // assumed: a page of flash
  std::uint32_t endurance = 10'000;  // writes of one parameter; STM32 data sheets' minimum
};

}  // namespace lk::emulator
