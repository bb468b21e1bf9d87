#pragma once

/// @file The windings behind three legs that are not alike, or not driven: some only have diodes
/// (docs/model.md §3), some are broken (§14). One drive, sixteen midpoint steps a period.

#include <array>
#include <cstdint>

#include "model/plant/motor.hpp"

namespace lk::model {

/// A leg's terminal, mean over a period: share·v_link − drop − R·i for a current into the motor,
/// share·v_link + drop − R·i for one out of it.
struct Leg {
  enum class Kind : std::uint8_t {
    kOpen,     // carries no current, whatever the voltage
    kDiodes,   // carries none while its terminal is between the voltages of the two directions
    kSwitches  // always connected; from one direction to the other in proportion within ±i_zone
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
  /// rad, by which theta_e may be beside the angle that the period before has ended at: as much of
  /// the other phases' current may then seem to flow where there is none.
  double slack = 0.0;
};

struct LegBridgeStep {
  WindingStep<double> step;
  /// W, mean: what currents that are cut off leave behind, in the switch, diode or arc that does
  /// it.
  double p_cut;
};

LegBridgeStep leg_bridge(const LegBridgeInput& in, const Legs& legs);

/// All six switches open: currents decay against the rails, each phase until it reaches zero and
/// stays there; with no current a phase pair conducts only while the line-to-line back-EMF exceeds
/// the link plus two diodes.
Legs open_switches(double v_diode);

}  // namespace lk::model
