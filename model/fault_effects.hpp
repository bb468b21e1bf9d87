#pragma once

/// @file Tests whether a fault has an effect now (docs/internals/model.md §14): computes the next
/// period from the same state with and without the fault.

#include "model/plant/thermal.hpp"
#include "model/tick.hpp"

namespace lk::model {

/// Inputs of a drive's next period. The comparisons ignore sensor noise, unless a fault adds noise.
struct Period {
  const PlantParams<double>& plant;
  const PlantState<double>& state;
  const CurrentLoopState<double>& loop;
  const LaneFaults& faults;
};

/// Returns true if currents or link voltage differ by an LSB of their ADC or more. Also if motion
/// of shafts or a temperature differs.
bool plants_differ(const Period& with, const Period& without, const SlowSensors& steps);

/// Returns true if a heat flow differs. The temperatures will then differ only after seconds or
/// minutes, so plants_differ() does not detect that.
bool heat_flows_differ(const Period& with, const Period& without);

/// Returns true if the fast sensors show different values.
bool measurements_differ(const Period& with, const Period& without);

/// Returns true if the slow sensors show different values.
bool slow_measurements_differ(const Faults& faults, const PlantState<double>& state,
                              const SlowSensors& sensors);

}  // namespace lk::model
