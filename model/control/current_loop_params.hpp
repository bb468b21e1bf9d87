#pragma once

/// @file What the current loop is given: gains, calibration and limits, of a drive's parameters.

#include "model/drive_params.hpp"
#include "model/setpoint.hpp"

namespace lk::model {

// Of the fast tick, which is heavy (model/control/current_loop.hpp).
template <class T>
struct CurrentLoopParams;

/// Largest |v| as a fraction of v_bus: the circle inside the hexagon, less what the legs keep back.
double modulation(const InverterParams& inverter);

/// Derived anew whenever a register changes.
CurrentLoopParams<double> current_loop_params(const DriveParams& drive,
                                              const ControlSettings& settings);

}  // namespace lk::model
