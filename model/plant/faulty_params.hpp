#pragma once

/// @file Faults that are expressed by other parameters of the same drive (docs/internals/model.md
/// §14).

#include "model/faults.hpp"
#include "model/plant/lane_faults.hpp"

namespace lk::model {

/// Returns the torque at `Faults::jam` = 1: k_t·(full scale of the current sensors)·N, Nm at the
/// output.
double jam_torque(const DriveParams& drive);

/// Returns the parameters of the plant with these faults.
DriveParams with_faults(const DriveParams& drive, const Faults& faults);

/// Returns the parameters that the firmware assumes, by the drive's own clock.
DriveParams by_own_clock(const DriveParams& drive, const Faults& faults);

/// Returns the faults that the tick applies. An encoder fault already in `before` continues.
LaneFaults lane_faults(const DriveParams& drive, const Faults& faults, const LaneFaults& before,
                       double shown_counts, std::uint64_t seed);

}  // namespace lk::model
