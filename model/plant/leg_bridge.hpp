#pragma once

/// @file Windings on legs with open switches, where only diodes conduct (docs/internals/model.md
/// §3), or with faults (§14). Solves one drive in sixteen midpoint steps per period.

#include <array>
#include <cstdint>

#include "model/faults.hpp"
#include "model/plant/motor.hpp"

namespace lk::model {

/// Mean voltage of a leg's terminal over a period: share·v_link − drop − R·i for i > 0 (into the
/// motor), share·v_link + drop − R·i for i < 0.
struct Leg {
  enum class Kind : std::uint8_t {
    kOpen,     // carries no current at any voltage
    kDiodes,   // carries no current while the terminal is between the voltages for i < 0 and i > 0
    kSwitches  // always conducts; changes linearly from one direction to the other within ±i_zone
  };
  Kind kind = Kind::kDiodes;
  double share_in = 0, share_out = 1;  // of v_link; in: i > 0, out: i < 0
  double drop_in = 0, drop_out = 0;    // V
  double R = 0;                        // Ω
};
using Legs = std::array<Leg, 3>;

/// One drive at the start of a period.
struct LegBridgeInput {
  Dq<double> i;
  double theta_e, omega_e;  // rad, rad/s
  double v_link, i_zone;    // V, A
  double R_s, L_d, L_q, psi_f;
  double T_s;
  /// rad, largest difference of theta_e to the angle at the end of the previous period. By this
  /// difference, a phase without current seems to carry a part of the other phases' current.
  double slack = 0.0;
};

struct LegBridgeStep {
  WindingStep<double> step;
  /// W, mean: magnetic energy of interrupted currents, which the switch, diode or arc dissipates.
  double p_cut;
};

LegBridgeStep leg_bridge(const LegBridgeInput& in, const Legs& legs);

/// Returns legs with all six switches open. Currents decay against the rails; a phase current that
/// reaches zero stays zero. Without current, a pair of phases conducts only while its back-EMF
/// exceeds the link voltage plus two diode drops.
Legs open_switches(double v_diode);

// Bridge with broken legs (docs/internals/model.md §14), in broken_legs.cpp.

/// Electrical parameters of a leg.
struct LegParts {
  double v_diode, R_on;             // V, Ω
  double dead_fraction, dead_drop;  // 1, V (inverter.hpp)
};

/// Returns the model of a leg with a fault.
Leg broken_leg(const LegParts& parts, LegFault fault, bool bridge_on, double duty);

/// Returns the share of the period in which both switches of a leg with this fault conduct.
double shoot_through(const LegParts& parts, LegFault fault, bool bridge_on, double duty);

/// Input of one period: the bridge and its link.
struct BrokenBridge {
  std::array<LegFault, 3> legs;
  std::array<double, 3> duty;
  bool on;
  double v_link, link_rate;  // V at the start of the period; C/T_s
  double i_emptying;         // A, largest current the link can give (supply.hpp)
};

struct BrokenBridgeStep {
  WindingStep<double> step;  // i_link includes i_short, p_inverter does not
  double i_short;            // A, mean current through legs whose switches both conduct
};

/// Computes one period. While both switches of a leg conduct, the link discharges like a capacitor
/// through 2·R_on.
BrokenBridgeStep broken_bridge_step(const LegBridgeInput& in, const LegParts& parts,
                                    const BrokenBridge& bridge);

}  // namespace lk::model
