#pragma once

/// @file Maps keys to the values that hosts can set: registers, gains, protections. Rows are as in
/// profile_fields.hpp.

#include "emulator/config/config_reader.hpp"
#include "emulator/core/parameter_memory.hpp"
#include "emulator/core/servo/registers.hpp"
#include "model/drive_params.hpp"

namespace lk::emulator::profile_fields {

// One row per line.
// clang-format off
inline constexpr double kGainMax = 255;        // a byte of 0x31, 0x32
inline constexpr double kWideGainMax = 65535;  // 16 bits of 0xC1
using G = model::GainBytes;
inline const Field<G> kGains[] = {
    {"angle_kp", &G::angle_kp, 1, 0, kGainMax},
    {"angle_ki", &G::angle_ki, 1, 0, kGainMax},
    {"speed_kp", &G::speed_kp, 1, 0, kGainMax},
    {"speed_ki", &G::speed_ki, 1, 0, kGainMax},
    {"current_kp", &G::current_kp, 1, 0, kGainMax},
    {"current_ki", &G::current_ki, 1, 0, kGainMax},
};

inline const Field<G> kWideGains[] = {
    {"angle_kp", &G::angle_kp, 1, 0, kWideGainMax},
    {"angle_ki", &G::angle_ki, 1, 0, kWideGainMax},
    {"speed_kp", &G::speed_kp, 1, 0, kWideGainMax},
    {"speed_ki", &G::speed_ki, 1, 0, kWideGainMax},
    {"current_kp", &G::current_kp, 1, 0, kWideGainMax},
    {"current_ki", &G::current_ki, 1, 0, kWideGainMax},
    {"angle_kd", &G::angle_kd, 1, 0, kWideGainMax},
    {"speed_kd", &G::speed_kd, 1, 0, kWideGainMax},
    {"current_kd", &G::current_kd, 1, 0, kWideGainMax},
};

using R = Registers;
inline const Field<R> kRegisters[] = {
    {"acceleration_dps_s", &R::acceleration_dps_s, 1, 0, 2147483647.0},
    {"encoder_offset", &R::encoder_offset, 1, 0, 65535},
    {"max_speed_dps", &R::max_speed_dps, 1, kMinSpeed_dps, kMaxSpeed_dps},
    {"max_angle_deg", &R::max_angle_deg, 1, 0, kMaxAngle_deg},
    {"current_ramp_A_s", &R::current_ramp_A_s, 1, 0, kMaxCurrentRamp_A_s},
    {"broadcast_mode", &R::broadcast_mode},
};

/// Address settings, which hosts write with 0x42 (docs/reference/protocol.md §10.9). The ranges
/// exclude kAsWired.
inline const Field<R> kPlace[] = {
    {"driver_id", &R::driver_id, 1, 0, 32},
    {"bus_type", &R::bus_type, 1, 0, 2},
    {"rs485_rate", &R::serial_rate, 1, 0, 10},
    {"can_rate", &R::can_rate, 1, 0, 4},
};
inline const Field<R> kAlignment[] = {
    {"align_value", &R::align_value, 1, 0, 2147483647.0},
};

/// Output limit of the loops: Max Power on MS drives, Max Torque Current on other series.
inline constexpr Field<R> max_power() { return {"max_power_permille", &R::max_power_permille, 1, 0, 850}; }
inline constexpr Field<R> max_torque_current(double limit_lsb) {
  return {"max_torque_current_lsb", &R::max_torque_current_lsb, 1, 0, limit_lsb};
}
// clang-format on

/// Name and keys of a protection. kProtections has them in the order of model::Error.
struct ProtectionKeys {
  const char* name;
  Field<model::Protection> fields[5];
};
using P = model::Protection;
inline constexpr Field<P> protection_enabled() { return {"enabled", &P::enabled}; }
inline constexpr Field<P> protection_delay() { return {"delay_s", &P::delay, 1, 0, 3600}; }
inline constexpr Field<P> protection_recoverable() { return {"recoverable", &P::recoverable}; }
inline constexpr ProtectionKeys protection(const char* name, const char* threshold,
                                           const char* hysteresis, double min, double max) {
  return {name,
          {protection_enabled(),
           {threshold, &P::threshold, 1, min, max},
           {hysteresis, &P::hysteresis, 1, 0, max},
           protection_delay(),
           protection_recoverable()}};
}
inline const ProtectionKeys kProtections[model::kErrorKinds] = {
    protection("under_voltage", "threshold_V", "hysteresis_V", 0, 100),
    protection("over_voltage", "threshold_V", "hysteresis_V", 0, 100),
    protection("driver_temperature", "threshold_C", "hysteresis_C", -40, 200),
    protection("motor_temperature", "threshold_C", "hysteresis_C", -40, 200),
    protection("over_current", "threshold_A", "hysteresis_A", 0, 1000),
    protection("short_circuit", "threshold_A", "hysteresis_A", 0, 1000),
    protection("stall", "threshold_s", "hysteresis_s", 0, 3600),
    protection("lost_input", "threshold_s", "hysteresis_s", 0, 3600),
};

}  // namespace lk::emulator::profile_fields
