#include "emulator/core/servo/registers.hpp"

#include <algorithm>
#include <cstdint>
#include <tuple>

#include "emulator/core/units.hpp"
#include "protocol/wire.hpp"

namespace lk::emulator {

using protocol::ParameterId;
using protocol::quantize;

namespace {

constexpr double kSpeedLsb_dps = 0.01;
constexpr double kAngleLsb_deg = 0.01;
constexpr double kCurrentRampLsb_A_s = 1e-3;

/// Clamps a parameter to the ranges of the later manuals.
protocol::Parameter within_ranges(protocol::Parameter parameter) {
  for (std::uint16_t* gain : {&parameter.gains.kp, &parameter.gains.ki, &parameter.gains.kd}) {
    *gain = std::min<std::uint16_t>(*gain, protocol::kMaxGain);
  }
  const auto most = [&](std::int32_t limit) {
    parameter.number = std::min(parameter.number, limit);
  };
  switch (parameter.id) {
    case ParameterId::kMaxTorqueCurrent:
      most(protocol::kMaxTorque_lsb);
      break;
    case ParameterId::kMaxSpeed:
      most(protocol::kMaxSpeed_cdps);
      break;
    case ParameterId::kCurrentRamp:
      most(protocol::kMaxCurrentRamp_mA_s);
      break;
    case ParameterId::kSpeedRamp:
      most(protocol::kMaxSpeedRamp_dps_s);
      break;
    case ParameterId::kAngleGains:
    case ParameterId::kSpeedGains:
    case ParameterId::kCurrentGains:
    case ParameterId::kMaxAngle:
      break;
  }
  return parameter;
}

}  // namespace

model::ControlSettings control_settings(const Registers& registers,
                                        const protocol::WireFormat& format) {
  // A register of 0 allows no current, but the control loops need a limit above 0. This limit is
  // too small to have a visible effect.
  constexpr double kNoCurrent_A = 1e-6;
  model::ControlSettings settings;
  settings.gains = registers.gains;
  // The MS series limits by power only.
  constexpr double kNoLimit_A = 1e3;
  settings.i_q_max =
      format.series == Series::kMs
          ? kNoLimit_A
          : std::max(registers.max_torque_current_lsb * format.iq_command_lsb_A, kNoCurrent_A);
  settings.power_max = registers.max_power_permille * 1e-3;
  settings.omega_max = rad_s_from_dps(registers.max_speed_dps);
  settings.accel_max = rad_s_from_dps(registers.acceleration_dps_s);
  settings.current_ramp = registers.current_ramp_A_s;
  settings.protections = registers.protections;
  return settings;
}

protocol::Parameter get_parameter(const Registers& registers, protocol::ParameterId id,
                                  const protocol::WireFormat& format) {
  const auto& gains = registers.gains;
  protocol::Parameter parameter{.id = id, .gains = {}, .number = 0};
  switch (id) {
    case ParameterId::kAngleGains:
      parameter.gains = {gains.angle_kp, gains.angle_ki, gains.angle_kd};
      break;
    case ParameterId::kSpeedGains:
      parameter.gains = {gains.speed_kp, gains.speed_ki, gains.speed_kd};
      break;
    case ParameterId::kCurrentGains:
      parameter.gains = {gains.current_kp, gains.current_ki, gains.current_kd};
      break;
    case ParameterId::kMaxTorqueCurrent:
      parameter.number = format.series == Series::kMs ? registers.max_power_permille
                                                      : registers.max_torque_current_lsb;
      break;
    case ParameterId::kMaxSpeed:
      parameter.number = quantize<std::int32_t>(registers.max_speed_dps, kSpeedLsb_dps);
      break;
    case ParameterId::kMaxAngle:
      parameter.number = quantize<std::int32_t>(registers.max_angle_deg, kAngleLsb_deg);
      break;
    case ParameterId::kCurrentRamp:
      parameter.number = quantize<std::int32_t>(registers.current_ramp_A_s, kCurrentRampLsb_A_s);
      break;
    case ParameterId::kSpeedRamp:
      parameter.number = registers.acceleration_dps_s;
      break;
  }
  return parameter;
}

std::int32_t in_16_bits(std::int32_t number) {
  return std::clamp<std::int32_t>(number, INT16_MIN, INT16_MAX);
}

void set_parameter(Registers& registers, const protocol::Parameter& wanted,
                   const protocol::WireFormat& format) {
  auto& gains = registers.gains;
  // Writing back a value just read changes nothing, even if the configured value is out of range.
  if (wanted == get_parameter(registers, wanted.id, format)) return;
  const protocol::Parameter parameter =
      format.dialect.parameter_ranges ? within_ranges(wanted) : wanted;
  const std::int32_t number = std::max(parameter.number, 0);  // registers have no sign
  switch (parameter.id) {
    case ParameterId::kAngleGains:
      gains.angle_kp = parameter.gains.kp;
      gains.angle_ki = parameter.gains.ki;
      gains.angle_kd = parameter.gains.kd;
      break;
    case ParameterId::kSpeedGains:
      gains.speed_kp = parameter.gains.kp;
      gains.speed_ki = parameter.gains.ki;
      gains.speed_kd = parameter.gains.kd;
      break;
    case ParameterId::kCurrentGains:
      gains.current_kp = parameter.gains.kp;
      gains.current_ki = parameter.gains.ki;
      gains.current_kd = parameter.gains.kd;
      break;
    case ParameterId::kMaxTorqueCurrent:
      if (format.series == Series::kMs) {
        registers.max_power_permille = std::min<std::int32_t>(number, protocol::kMaxPower_permille);
      } else {
        registers.max_torque_current_lsb =
            std::min<std::int32_t>(number, format.dialect.iq_command_limit_lsb);
      }
      break;
    case ParameterId::kMaxSpeed:
      registers.max_speed_dps = std::clamp(number * kSpeedLsb_dps, kMinSpeed_dps, kMaxSpeed_dps);
      break;
    case ParameterId::kMaxAngle:
      registers.max_angle_deg = std::min(number * kAngleLsb_deg, kMaxAngle_deg);
      break;
    case ParameterId::kCurrentRamp:
      registers.current_ramp_A_s = std::min(number * kCurrentRampLsb_A_s, kMaxCurrentRamp_A_s);
      break;
    case ParameterId::kSpeedRamp:
      registers.acceleration_dps_s = number;
      break;
  }
}

RomParameter rom_parameter_of(ParameterId id, Series series) {
  switch (id) {
    case ParameterId::kAngleGains:
    case ParameterId::kSpeedGains:
    case ParameterId::kCurrentGains:
      return RomParameter::kGains;
    case ParameterId::kMaxTorqueCurrent:
      return series == Series::kMs ? RomParameter::kMaxPower : RomParameter::kMaxTorqueCurrent;
    case ParameterId::kMaxSpeed:
      return RomParameter::kMaxSpeed;
    case ParameterId::kMaxAngle:
      return RomParameter::kMaxAngle;
    case ParameterId::kCurrentRamp:
      return RomParameter::kCurrentRamp;
    case ParameterId::kSpeedRamp:
      return RomParameter::kAcceleration;
  }
  return RomParameter::kGains;
}

void copy_parameter(RomParameter parameter, const Registers& from, Registers& to) {
  // In the order of RomParameter.
  constexpr auto kMembers = std::tuple(
      &Registers::gains, &Registers::acceleration_dps_s, &Registers::encoder_offset,
      &Registers::max_torque_current_lsb, &Registers::max_power_permille, &Registers::max_speed_dps,
      &Registers::max_angle_deg, &Registers::current_ramp_A_s, &Registers::broadcast_mode,
      &Registers::protections, &Registers::align_value, &Registers::driver_id, &Registers::bus_type,
      &Registers::serial_rate, &Registers::can_rate);
  static_assert(std::tuple_size_v<decltype(kMembers)> == kRomParameters);
  const auto copy = [&](RomParameter one, auto member) {
    if (one == parameter) to.*member = from.*member;
  };
  std::apply(
      [&](auto... members) {
        int place = 0;
        (copy(static_cast<RomParameter>(place++), members), ...);
      },
      kMembers);
}

}  // namespace lk::emulator
