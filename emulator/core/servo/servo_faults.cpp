// Effects of injected faults on the firmware and its memory.

#include <algorithm>
#include <array>

#include "emulator/core/servo/servo_commands.hpp"
#include "protocol/rounding.hpp"

namespace lk::emulator {
namespace {

/// Flips a bit of the integer part of `value`; the fraction stays. `random` selects among the bits
/// that keep it within [min, max], the range of the register.
double flipped(double value, std::uint64_t random, double min, double max) {
  const std::int64_t whole = protocol::rounded_down(value);
  const double fraction = value - static_cast<double>(whole);
  std::array<double, 32> possible{};
  std::size_t count = 0;
  for (unsigned bit = 0; bit < possible.size(); ++bit) {
    const auto bits = whole ^ (std::int64_t{1} << bit);
    const double result = static_cast<double>(bits) + fraction;
    if (result >= min && result <= max) possible[count++] = result;
  }
  return count > 0 ? possible[random % count] : value;
}

/// Flips a gain that hosts can set; Kd has no effect.
void flip_gain(model::GainBytes& gains, std::uint64_t random, double max) {
  const std::array<std::uint16_t*, 6> all = {&gains.angle_kp, &gains.angle_ki,   &gains.speed_kp,
                                             &gains.speed_ki, &gains.current_kp, &gains.current_ki};
  std::uint16_t& gain = *all[random % all.size()];
  gain = static_cast<std::uint16_t>(flipped(gain, random / all.size(), 0, max));
}

/// Flips a bit of `parameter` in `r`, selected by `random`; keeps the value within its range.
void flip(RomParameter parameter, std::uint64_t random, const protocol::Dialect& dialect,
          std::uint16_t max_offset, Registers& r) {
  const auto whole = [random](auto value, double max) {
    return static_cast<decltype(value)>(flipped(value, random, 0, max));
  };
  switch (parameter) {
    case RomParameter::kGains:
      flip_gain(r.gains, random, dialect.parameter_commands ? 65535 : 255);
      break;
    case RomParameter::kAcceleration:
      r.acceleration_dps_s = whole(r.acceleration_dps_s, 2147483647.0);
      break;
    case RomParameter::kEncoderOffset:
      r.encoder_offset = whole(r.encoder_offset, max_offset);
      break;
    case RomParameter::kMaxTorqueCurrent:
      r.max_torque_current_lsb = whole(r.max_torque_current_lsb, dialect.iq_command_limit_lsb);
      break;
    case RomParameter::kMaxPower:
      r.max_power_permille = whole(r.max_power_permille, protocol::kMaxPower_permille);
      break;
    case RomParameter::kMaxSpeed:
      r.max_speed_dps = flipped(r.max_speed_dps, random, kMinSpeed_dps, kMaxSpeed_dps);
      break;
    case RomParameter::kMaxAngle:
      r.max_angle_deg = flipped(r.max_angle_deg, random, 0, kMaxAngle_deg);
      break;
    case RomParameter::kCurrentRamp:
      r.current_ramp_A_s = flipped(r.current_ramp_A_s, random, 0, kMaxCurrentRamp_A_s);
      break;
    case RomParameter::kBroadcastMode:
      r.broadcast_mode = !r.broadcast_mode;
      break;
    case RomParameter::kProtections:  // thresholds of several kinds: not supported
    case RomParameter::kAlignValue:   // no loop reads it
    case RomParameter::kDriverId:     // in force from the next start, which reads ROM
    case RomParameter::kBusType:
    case RomParameter::kSerialRate:
    case RomParameter::kCanRate:
      break;
  }
}

}  // namespace

void apply_startup_faults(Servo& servo) {
  if (servo.faults.forgets_broadcast && servo.ram.broadcast_mode) {
    servo.ram.broadcast_mode = false;
    servo.effective_faults.forgets_broadcast = true;
  }
  if (servo.faults.forgets_limits) {
    const Registers& factory = servo.config.profile.factory;
    const Registers kept = servo.ram;
    servo.ram.acceleration_dps_s = factory.acceleration_dps_s;
    servo.ram.max_torque_current_lsb = factory.max_torque_current_lsb;
    servo.ram.max_power_permille = factory.max_power_permille;
    servo.ram.max_speed_dps = factory.max_speed_dps;
    servo.ram.max_angle_deg = factory.max_angle_deg;
    servo.ram.current_ramp_A_s = factory.current_ramp_A_s;
    servo.effective_faults.forgets_limits |= !(servo.ram == kept);
  }
}

void apply_turn_faults(Servo& servo, const model::Telemetry& telemetry) {
  const std::int64_t position = servo.angles.position(telemetry);
  const std::int64_t right_cdeg = servo.angles.multi_turn_cdeg(position);
  if (servo.faults.multi_turn_zero_at_boot) {
    servo.angles.set_multi_turn(position, 0);
    servo.effective_faults.multi_turn_zero_at_boot |= right_cdeg != 0;
  }
  if (servo.faults.encoder_wrap_at_boot) {
    servo.angles.miscount_turns(servo.faults.turns_at_boot);
    servo.effective_faults.encoder_wrap_at_boot |= servo.faults.turns_at_boot != 0;
  }
}

void arm_command_loss(Servo& servo, LostAfter what) {
  servo.loses_next =
      servo.loses_next || (servo.faults.first_command_lost && servo.faults.lost_after == what);
}

bool damage_rom(Servo& servo, RomParameter parameter) {
  const Registers before = servo.rom;
  copy_parameter(parameter, servo.config.profile.factory, servo.rom);
  if (servo.rom == before) return false;
  ++servo.stats.rom_writes;
  return true;
}

bool flip_ram(Servo& servo, RomParameter parameter, std::uint64_t random, const Lane& lane) {
  const Registers before = servo.ram;
  flip(parameter, random, servo.format.dialect, servo.angles.max_wire_count(), servo.ram);
  if (parameter == RomParameter::kEncoderOffset) {
    apply_offset(servo);
  }
  apply_ram(servo, lane);
  return !(servo.ram == before);
}

}  // namespace lk::emulator
