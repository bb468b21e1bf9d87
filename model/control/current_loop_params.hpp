#pragma once

/// @file Derives gains, calibration and limits of the current loop from a drive's parameters.

#include "model/drive_params.hpp"
#include "model/setpoint.hpp"

namespace lk::model {

// Defined in model/control/current_loop.hpp, which is slow to compile.
template <class T>
struct CurrentLoopParams;

/// Returns the largest |v| / v_bus: the circle inside the voltage hexagon, reduced by duty_max.
double modulation(const InverterParams& inverter);

/// Returns the parameters of the current loop. Call again whenever a register changes.
CurrentLoopParams<double> current_loop_params(const DriveParams& drive,
                                              const ControlSettings& settings);

}  // namespace lk::model
