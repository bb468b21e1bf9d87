#pragma once

/// @file Tests whether a fault has an effect now (docs/internals/model.md §14): computes the next
/// period with it and without it, from the same state.

#include "model/plant/thermal.hpp"
#include "model/tick.hpp"

namespace lk::model {

/// Input of a drive's next period, without noise: its plant, its state, and what acts on it.
struct Period {
  const PlantParams<double>& plant;
  const PlantState<double>& state;
  const CurrentLoopState<double>& loop;
  const LaneFaults& faults;
};

/// Returns true if currents or link voltage differ by a step of their converter, or if the motion
/// of the shafts or a temperature differs.
bool plants_differ(const Period& with, const Period& without, const SlowSensors& steps);

/// Returns true if a heat flow differs. Temperatures then differ after seconds or minutes, which no
/// single period shows.
bool heat_flows_differ(const Period& with, const Period& without);

/// Returns true if the fast sensors show different values.
bool measurements_differ(const Period& with, const Period& without);

/// Returns true if the slow sensors show different values.
bool slow_measurements_differ(const Faults& faults, const PlantState<double>& state,
                              const SlowSensors& sensors);

}  // namespace lk::model
