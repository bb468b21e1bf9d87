#pragma once

/// @file One period of a bridge with broken legs (docs/internals/model.md §14).

#include "model/faults.hpp"
#include "model/plant/leg_bridge.hpp"

namespace lk::model {

/// Electrical parameters of a leg.
struct LegParts {
  double v_diode, R_on;             // V, Ω
  double dead_fraction, dead_drop;  // 1, V (inverter.hpp)
};

/// Returns the model of a leg with a fault.
Leg broken_leg(const LegParts& parts, LegFault fault, bool bridge_on, double duty);

/// Returns the share of the period in which both switches of such a leg conduct.
double shoot_through(const LegParts& parts, LegFault fault, bool bridge_on, double duty);

/// Input of one period: the bridge and its link.
struct BrokenBridge {
  std::array<LegFault, 3> legs;
  std::array<double, 3> duty;
  bool on;
  double v_link, link_rate;  // V at the start, C/T_s
  double i_emptying;         // A, largest current the link can give (supply.hpp)
};

struct BrokenBridgeStep {
  WindingStep<double> step;  // i_link includes i_short, p_inverter does not
  double i_short;            // A, mean, from rail to rail
};

/// Computes one period. While both switches of a leg conduct, the link discharges like a capacitor
/// through 2·R_on.
BrokenBridgeStep broken_bridge_step(const LegBridgeInput& in, const LegParts& parts,
                                    const BrokenBridge& bridge);

}  // namespace lk::model
