#pragma once

#include "emulator/core/bus_config.hpp"

namespace lk::emulator {

/// Figures that follow from a profile, in closed form (docs/model.md §3, §11). At 25 °C, nominal
/// supply and factory registers; speeds and torques at the output shaft.
struct MotorFigures {
  double k_t_Nm_A = 0;           // rotor side, 3/2·p·ψ_f
  double no_load_speed_rpm = 0;  // back-EMF, friction current and dead time use up the voltage
  double stall_torque_Nm = 0;    // at the largest current that supply and sensor allow
  double stall_current_A = 0;
  double electrical_time_constant_ms = 0;  // L_q/R
  double mechanical_time_constant_ms = 0;  // R·J/(3/2·p²·ψ_f²): to 63 % speed at constant voltage
  double current_bandwidth_Hz = 0;         // with the factory gains
  double speed_bandwidth_Hz = 0;
  double position_bandwidth_Hz = 0;
};

MotorFigures motor_figures(const Profile& profile);

}  // namespace lk::emulator
