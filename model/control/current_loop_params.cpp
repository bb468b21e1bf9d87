#include "model/control/current_loop_params.hpp"

#include <algorithm>
#include <numbers>

#include "model/control/current_loop.hpp"

namespace lk::model {

double modulation(const InverterParams& inverter) {
  return (2.0 * inverter.duty_max - 1.0) / kSqrt3;
}

CurrentLoopParams<double> current_loop_params(const DriveParams& drive,
                                              const ControlSettings& settings) {
  const ControlParams& c = drive.control;
  const double bandwidth_p = c.current_bandwidth * settings.gains.current_kp / c.ref_current_byte;
  const double bandwidth_i = c.current_bandwidth * settings.gains.current_ki / c.ref_current_byte;
  CurrentLoopParams<double> p;
  p.closed = c.has_current_loop ? 1.0 : 0.0;
  p.rad_e_per_count = drive.motor.pole_pairs * drive.encoder.direction * kTwoPi /
                      static_cast<double>(1 << drive.encoder.bits);
  // Adds half a count: a reading stands for the middle of its interval of angles.
  p.rad_e_offset = drive.motor.pole_pairs * drive.encoder.direction * drive.encoder.offset -
                   0.5 * p.rad_e_per_count;
  p.kp_d = bandwidth_p * drive.motor.L_d;
  p.kp_q = bandwidth_p * drive.motor.L_q;
  p.ki_T = p.closed * bandwidth_i * drive.motor.R_s / drive.inverter.f_pwm;
  p.unwind_d = p.kp_d > 0.0 ? std::min(1.0, p.ki_T / p.kp_d) : 1.0;
  p.unwind_q = p.kp_q > 0.0 ? std::min(1.0, p.ki_T / p.kp_q) : 1.0;
  p.L_d = drive.motor.L_d;
  p.L_q = drive.motor.L_q;
  p.psi_f = c.emf_share * drive.motor.psi_f;
  p.advance_time = 1.5 / drive.inverter.f_pwm;
  p.modulation = modulation(drive.inverter);
  p.timer_counts = drive.inverter.timer_counts;
  p.timer_lsb = 1.0 / drive.inverter.timer_counts;
  p.duty_max = drive.inverter.duty_max;
  return p;
}

}  // namespace lk::model
