#pragma once

/// @file A bridge with broken legs, for a period (docs/model.md §14).

#include "model/faults.hpp"
#include "model/plant/leg_bridge.hpp"

namespace lk::model {

/// What a leg is made of.
struct LegParts {
  double v_diode, R_on;             // V, Ω
  double dead_fraction, dead_drop;  // 1, V (inverter.hpp)
};

/// A leg of a bridge that is on, or off, with a fault.
Leg broken_leg(const LegParts& parts, LegFault fault, bool bridge_on, double duty);

/// Share of the period in which such a leg connects the rails through both its switches.
double shoot_through(const LegParts& parts, LegFault fault, bool bridge_on, double duty);

/// A bridge's period, and the link it is fed from.
struct BrokenBridge {
  std::array<LegFault, 3> legs;
  std::array<double, 3> duty;
  bool on;
  double v_link, link_rate;  // V at the start, C/T_s
  double i_emptying;         // A, the most the link has (supply.hpp)
};

struct BrokenBridgeStep {
  WindingStep<double> step;  // its i_link with i_short, its p_inverter without
  double i_short;            // A, mean, from rail to rail
};

/// The legs' period. Both switches of a leg discharge the link like a capacitor through 2·R_on, for
/// as long as they both conduct.
BrokenBridgeStep broken_bridge_step(const LegBridgeInput& in, const LegParts& parts,
                                    const BrokenBridge& bridge);

}  // namespace lk::model
