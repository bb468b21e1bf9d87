#pragma once

/// @file Gains, the parameters of 0xC0 and 0xC1, and the settings of 0x40 and 0x42 on CAN.

#include <cstdint>

namespace lk::protocol {

/// Gains of the three loops, 0..255, dimensionless.
struct PidGains {
  std::uint8_t angle_kp = 0, angle_ki = 0;
  std::uint8_t speed_kp = 0, speed_ki = 0;
  std::uint8_t iq_kp = 0, iq_ki = 0;
  bool operator==(const PidGains&) const = default;
};

/// Parameters of 0xC0 and 0xC1.
enum class ParameterId : std::uint8_t {
  kAngleGains = 0x0A,
  kSpeedGains = 0x0B,
  kCurrentGains = 0x0C,
  kMaxTorqueCurrent = 0x1E,  // Max Power on MS
  kMaxSpeed = 0x20,
  kMaxAngle = 0x22,
  kCurrentRamp = 0x24,
  kSpeedRamp = 0x26,
};
/// Gains of one loop as 16-bit numbers, on the same scale as the bytes of 0x30.
struct LoopGains {
  std::uint16_t kp = 0, ki = 0, kd = 0;
  bool operator==(const LoopGains&) const = default;
};

struct Parameter {
  ParameterId id = ParameterId::kAngleGains;
  LoopGains gains;          // 0x0A, 0x0B, 0x0C
  std::int32_t number = 0;  // the others
  bool operator==(const Parameter&) const = default;
};

// Largest values of parameters and settings, as the manuals print them. Exception: Max Speed. Its
// printed 6000 dps is below the 16800 dps of delivered drives. So this is the 72000 dps that is
// printed for the boards of MG drives.
inline constexpr std::int32_t kMaxGain = 2000;
inline constexpr std::int32_t kMaxTorque_lsb = 2000;
inline constexpr std::int32_t kMaxSpeed_cdps = 7'200'000;
inline constexpr std::int32_t kMaxCurrentRamp_mA_s = 30'000;
inline constexpr std::int32_t kMaxSpeedRamp_dps_s = 600'000;

/// Settings of 0x40 and 0x42 on CAN. Low byte: DATA[1]. High byte: DATA[2] if DATA[1] is 0x05.
enum class StoredSettingId : std::uint16_t {
  kDriverId = 0x0A05,          // 0: from the DIP switch
  kBusType = 0x0B05,           // BusType
  kSerialRate = 0x0C05,        // code of the bit rate on RS-485
  kCanRate = 0x0D05,           // code of the bit rate on CAN
  kMaxTorqueCurrent = 0xE005,  // Max Power on MS
  kMaxSpeed = 0xE205,
  kMaxAngle = 0xE405,
  kCurrentRamp = 0xEA05,
  kSpeedRamp = 0xEC05,
  kAngleGains = 0x00A0,
  kSpeedGains = 0x00A4,
  kCurrentGains = 0x00A8,
};
/// Value of DATA[1] if DATA[2] selects the setting.
inline constexpr std::uint8_t kNamedSettings = 0x05;

/// Bus that a drive is set to use.
enum class BusType : std::uint8_t { kNone, kSerial, kCan };

struct StoredSetting {
  std::uint8_t table = kNamedSettings;  // DATA[1]
  std::uint8_t item = 0;                // DATA[2], if `table` is kNamedSettings
  LoopGains gains;                      // 0xA0, 0xA4, 0xA8
  std::int32_t number = 0;              // the others
  constexpr StoredSettingId id() const {
    return static_cast<StoredSettingId>(table | (table == kNamedSettings ? item << 8 : 0));
  }
  bool operator==(const StoredSetting&) const = default;
};

}  // namespace lk::protocol
