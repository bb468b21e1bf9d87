#pragma once

/// @file Gains, and the parameters of 0xC0 and 0xC1.

#include <cstdint>

namespace lk::protocol {

/// Gains of the three loops, 0..255, dimensionless.
struct PidGains {
  std::uint8_t angle_kp = 0, angle_ki = 0;
  std::uint8_t speed_kp = 0, speed_ki = 0;
  std::uint8_t iq_kp = 0, iq_ki = 0;
  bool operator==(const PidGains&) const = default;
};

/// What 0xC0 and 0xC1 can name.
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
/// The gains of one loop; 16 bits on the scale of the bytes of 0x30.
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

}  // namespace lk::protocol
