#pragma once

/// @file Whether a fault makes a difference at an instant (docs/model.md §14): the coming period is
/// computed with it and without, from the same state.

#include "model/plant/slow_sensors.hpp"
#include "model/tick.hpp"

namespace lk::model {

/// A drive's coming period, without noise: its plant, its state, and what acts on it.
struct Period {
  const PlantParams<double>& plant;
  const PlantState<double>& state;
  const CurrentLoopState<double>& loop;
  const LaneFaults& faults;
};

/// Currents or link voltage come out differently by a step of their converter, the shafts move
/// differently, or something gets warmer or colder.
bool plants_differ(const Period& with, const Period& without, const SlowSensors& steps);

/// Heat flows another way, or more or less of it: what is warmer or colder than what it lies beside
/// will differ, in seconds or minutes. No single period shows that.
bool heat_flows_differ(const Period& with, const Period& without);

/// The fast sensors show something else.
bool measurements_differ(const Period& with, const Period& without);

/// The slow sensors show something else.
bool slow_measurements_differ(const Faults& faults, const PlantState<double>& state,
                              const SlowSensors& sensors);

}  // namespace lk::model
