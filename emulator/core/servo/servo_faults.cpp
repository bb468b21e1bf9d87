// Effects of injected faults on the firmware and its memory.

#include <algorithm>
#include <array>

#include "emulator/core/servo/servo.hpp"
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

/// Keeps the value within the range of the register.
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

void Servo::apply_startup_faults() {
  if (faults_.forgets_broadcast && ram_.broadcast_mode) {
    ram_.broadcast_mode = false;
    shown_faults_.forgets_broadcast = true;
  }
  if (faults_.forgets_limits) {
    const Registers& factory = config_.profile.factory;
    const Registers kept = ram_;
    ram_.acceleration_dps_s = factory.acceleration_dps_s;
    ram_.max_torque_current_lsb = factory.max_torque_current_lsb;
    ram_.max_power_permille = factory.max_power_permille;
    ram_.max_speed_dps = factory.max_speed_dps;
    ram_.max_angle_deg = factory.max_angle_deg;
    ram_.current_ramp_A_s = factory.current_ramp_A_s;
    shown_faults_.forgets_limits |= !(ram_ == kept);
  }
}

void Servo::apply_turn_faults(const model::Telemetry& telemetry) {
  const std::int64_t position = angles_.position(telemetry);
  const std::int64_t right_cdeg = angles_.multi_turn_cdeg(position);
  if (faults_.multi_turn_zero_at_boot) {
    angles_.set_multi_turn(position, 0);
    shown_faults_.multi_turn_zero_at_boot |= right_cdeg != 0;
  }
  if (faults_.encoder_wrap_at_boot) {
    angles_.miscount_turns(faults_.turns_at_boot);
    shown_faults_.encoder_wrap_at_boot |= faults_.turns_at_boot != 0;
  }
}

void Servo::arm_command_loss(LostAfter what) {
  loses_next_ = loses_next_ || (faults_.first_command_lost && faults_.lost_after == what);
}

bool Servo::damage_rom(RomParameter parameter) {
  const Registers before = rom_;
  copy_parameter(parameter, config_.profile.factory, rom_);
  if (rom_ == before) return false;
  ++stats_.rom_writes;
  return true;
}

bool Servo::flip_ram(RomParameter parameter, std::uint64_t random, const Lane& lane) {
  const Registers before = ram_;
  flip(parameter, random, format_.dialect, angles_.max_wire_count(), ram_);
  if (parameter == RomParameter::kEncoderOffset) {
    angles_.set_offset(ram_.encoder_offset);
    motion_.single_turn.reset();  // the target is now another position
  }
  configure(lane);
  reapply_limits(lane);
  return !(ram_ == before);
}

}  // namespace lk::emulator
