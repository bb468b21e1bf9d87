#pragma once

/// @file Applies faults to drives by changing parameters (docs/internals/model.md §14).

#include "model/faults.hpp"
#include "model/plant/lane_faults.hpp"

namespace lk::model {

/// Returns the friction torque for `Faults::jam` = 1: k_t·(full scale of the current sensors)·N, in
/// Nm at the output.
double jam_torque(const DriveParams& drive);

/// Returns the parameters of the drive's hardware with these faults.
DriveParams with_faults(const DriveParams& drive, const Faults& faults);

/// Returns the parameters that the firmware uses: times are those of the drive's own, wrong clock.
DriveParams by_own_clock(const DriveParams& drive, const Faults& faults);

/// Returns the faults that the tick applies. If `before` has the same encoder fault, this fault
/// continues; else it starts at the reading `shown_counts`.
LaneFaults lane_faults(const DriveParams& drive, const Faults& faults, const LaneFaults& before,
                       double shown_counts, std::uint64_t seed);

}  // namespace lk::model
