#pragma once

/// @file The windings while the bridge is off: only its body diodes conduct (docs/model.md §3).

#include "model/plant/motor.hpp"

namespace lk::model {

/// One drive at the start of a period with all six switches open.
struct DiodeBridgeInput {
  Dq<double> i;
  double theta_e, omega_e;  // rad, rad/s
  double v_link, v_diode;   // V
  double R_s, L_d, L_q, psi_f;
  double T_s;
};

/// Currents decay against the rails, each phase until it reaches zero and stays there; with no
/// current a phase pair conducts only while the line-to-line back-EMF exceeds the link plus two
/// diodes.
WindingStep<double> diode_bridge(const DiodeBridgeInput& in);

}  // namespace lk::model
