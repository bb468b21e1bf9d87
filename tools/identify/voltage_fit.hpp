#pragma once

/// @file What a log tells of the windings: where the drive is told more current than the supply's
/// voltage lets through, √(V² − (ω_e·L_q·iq)²) = R·iq + p·ψ·ω (docs/model.md §3, §10), with the L_q
/// of the motor file.

#include <optional>

#include "tools/identify/estimate.hpp"
#include "tools/identify/track.hpp"

namespace lk::emulator {

struct VoltageFit {
  Estimate no_load_rad_s;            // V/(p·ψ): where no voltage is left for a current
  std::optional<Estimate> k_t_Nm_A;  // 3/2·p·ψ, where the log has the voltage of the supply
  // Of a phase with its switch, and half of what the supply has: its voltage falls with the
  // current.
  std::optional<Estimate> R_ohm;
};

/// Nothing where the drive never was at that limit, or at too few speeds.
std::optional<VoltageFit> fit_voltage(const Track& track);

}  // namespace lk::emulator
