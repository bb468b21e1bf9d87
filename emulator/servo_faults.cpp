// What injected faults do to the firmware and its memory.

#include <algorithm>
#include <array>
#include <cmath>

#include "emulator/servo.hpp"

namespace lk::emulator {
namespace {

/// One of the lowest `bits` bits, chosen by `random`.
std::uint32_t one_bit(std::uint64_t random, std::uint64_t bits) {
  return 1U << static_cast<unsigned>(random % bits);
}

double flipped(double value, std::uint64_t random, double min, double max) {
  const auto whole = static_cast<std::uint32_t>(std::llround(value));
  return std::clamp(static_cast<double>(whole ^ one_bit(random, 16)), min, max);
}

void flip_gain(model::GainBytes& gains, std::uint64_t random) {
  const std::array<std::uint16_t*, 6> bytes = {&gains.angle_kp,   &gains.angle_ki,
                                               &gains.speed_kp,   &gains.speed_ki,
                                               &gains.current_kp, &gains.current_ki};
  std::uint16_t& gain = *bytes[random / 8 % bytes.size()];
  gain = static_cast<std::uint16_t>(gain ^ one_bit(random, 8));
}

/// Within what the register can hold.
void flip(RomParameter parameter, std::uint64_t random, Registers& r) {
  const auto whole = [random](auto value, double max) {
    return static_cast<decltype(value)>(flipped(value, random, 0, max));
  };
  switch (parameter) {
    case RomParameter::kGains:
      flip_gain(r.gains, random);
      break;
    case RomParameter::kAcceleration:
      r.acceleration_dps_s = whole(r.acceleration_dps_s, 2147483647.0);
      break;
    case RomParameter::kEncoderOffset:
      r.encoder_offset = static_cast<std::uint16_t>(r.encoder_offset ^ one_bit(random, 14));
      break;
    case RomParameter::kMaxTorqueCurrent:
      r.max_torque_current_lsb = whole(r.max_torque_current_lsb, 2000);
      break;
    case RomParameter::kMaxPower:
      r.max_power_permille = whole(r.max_power_permille, 850);
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
    case RomParameter::kProtections:
      break;
  }
}

}  // namespace

void Servo::forget_what_faults_forget() {
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

bool Servo::damage_rom(RomParameter parameter) {
  const Registers before = rom_;
  copy_parameter(parameter, config_.profile.factory, rom_);
  return !(rom_ == before);
}

bool Servo::flip_ram(RomParameter parameter, std::uint64_t random, const Lane& lane) {
  const Registers before = ram_;
  flip(parameter, random, ram_);
  if (parameter == RomParameter::kEncoderOffset) {
    ram_.encoder_offset = std::min(ram_.encoder_offset, angles_.max_wire_count());
    angles_.set_offset(ram_.encoder_offset);
    motion_.single_turn.reset();  // the same target is another place from now on
  }
  configure(lane);
  limit_anew(lane);
  return !(ram_ == before);
}

}  // namespace lk::emulator
