#include "emulator/registers.hpp"

#include <algorithm>

#include "emulator/units.hpp"
#include "protocol/wire_format.hpp"

namespace lk::emulator {

bool operator==(const Registers& a, const Registers& b) {
  const auto same = [](const model::Protection& p, const model::Protection& q) {
    return p.enabled == q.enabled && p.threshold == q.threshold && p.hysteresis == q.hysteresis &&
           p.delay == q.delay;
  };
  return a.gains == b.gains && a.acceleration_dps_s == b.acceleration_dps_s &&
         a.encoder_offset == b.encoder_offset &&
         a.max_torque_current_lsb == b.max_torque_current_lsb &&
         a.max_speed_dps == b.max_speed_dps && a.max_angle_deg == b.max_angle_deg &&
         a.current_ramp_A_s == b.current_ramp_A_s && a.broadcast_mode == b.broadcast_mode &&
         std::ranges::equal(a.protections, b.protections, same);
}

model::ControlSettings control_settings(const Registers& registers) {
  // A register of 0 lets no current through; the loops want a limit above 0, so it is one that
  // nothing can be seen of.
  constexpr double kNoCurrent_A = 1e-6;
  model::ControlSettings settings;
  settings.gains = registers.gains;
  settings.i_q_max = std::max(
      registers.max_torque_current_lsb * protocol::kLegacyFormat.iq_command_lsb_A, kNoCurrent_A);
  settings.omega_max = rad_s_from_dps(registers.max_speed_dps);
  settings.accel_max = rad_s_from_dps(registers.acceleration_dps_s);
  settings.current_ramp = registers.current_ramp_A_s;
  settings.protections = registers.protections;
  return settings;
}

}  // namespace lk::emulator
