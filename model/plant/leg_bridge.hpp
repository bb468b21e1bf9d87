#pragma once

/// @file Windings behind legs that differ or are not driven: some have only diodes
/// (docs/internals/model.md §3), some are broken (§14). Solves one drive in sixteen midpoint steps
/// per period.

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
    kDiodes,   // carries none while its terminal is between the voltages of the two directions
    kSwitches  // always connected; blends both directions linearly within ±i_zone
  };
  Kind kind = Kind::kDiodes;
  double share_in = 0, share_out = 1;  // of the link
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
  /// rad, possible error of theta_e against the end of the previous period. This error makes some
  /// of the other phases' current appear in a phase without current.
  double slack = 0.0;
};

struct LegBridgeStep {
  WindingStep<double> step;
  /// W, mean: energy of interrupted currents, lost in the switch, diode or arc.
  double p_cut;
};

LegBridgeStep leg_bridge(const LegBridgeInput& in, const Legs& legs);

/// Returns legs with all six switches open. Currents decay against the rails; a phase that reaches
/// zero stays there. With no current, a phase pair conducts only while the line-to-line back-EMF
/// exceeds the link plus two diodes.
Legs open_switches(double v_diode);

// A bridge with broken legs (docs/internals/model.md §14): broken_legs.cpp.

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
