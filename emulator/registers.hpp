#pragma once

#include "emulator/bus_config.hpp"
#include "model/setpoint.hpp"

namespace lk::emulator {

/// The registers as the loops and the protections read them: SI, rotor side.
model::ControlSettings control_settings(const Registers& registers);

}  // namespace lk::emulator
