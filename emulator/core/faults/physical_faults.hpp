#pragma once

#include "emulator/core/bus_config.hpp"
#include "emulator/core/faults/live_fault.hpp"
#include "model/faults.hpp"

namespace lk::emulator {

/// The kind acts on the motor, its sensors, its supply or the drive's clock.
bool is_physical(FaultKind kind);

/// What a fault does to one of its drives at `now`, on top of what `sum` holds already.
void add_physical_fault(const LiveFault& live, const ServoConfig& servo, SimTime now,
                        model::Faults& sum);

}  // namespace lk::emulator
