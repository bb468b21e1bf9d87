#pragma once

/// @file Windings behind legs that differ or are not driven: some have only diodes
/// (docs/internals/model.md §3), some are broken (§14). Solves one drive in sixteen midpoint steps
/// per period.

#include <array>
#include <cstdint>

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

}  // namespace lk::model
