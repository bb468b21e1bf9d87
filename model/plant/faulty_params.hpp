#pragma once

/// @file Faults that other numbers of the same drive express (docs/model.md §14).

#include "model/faults.hpp"
#include "model/plant/lane_faults.hpp"

namespace lk::model {

/// The torque that `Faults::jam` is a share of: k_t·(full scale of the current sensors)·N, Nm at
/// the output.
double jam_torque(const DriveParams& drive);

/// The drive as its plant is with these faults.
DriveParams with_faults(const DriveParams& drive, const Faults& faults);

/// The drive as its firmware takes it to be, by its own clock.
DriveParams by_own_clock(const DriveParams& drive, const Faults& faults);

/// What remains for the tick. An encoder fault that `before` has already goes on.
LaneFaults lane_faults(const DriveParams& drive, const Faults& faults, const LaneFaults& before,
                       double shown_counts, std::uint64_t seed);

}  // namespace lk::model
