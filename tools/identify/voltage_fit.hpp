#pragma once

/// @file What a log tells of the windings: where the drive is told more current than the supply's
/// voltage lets through, iq = V/R − (p·ψ/R)·ω.

#include <optional>

#include "tools/identify/estimate.hpp"
#include "tools/identify/track.hpp"

namespace lk::emulator {

struct VoltageFit {
  Estimate stall_A;        // V/R: where the line meets standstill
  Estimate no_load_rad_s;  // V/(p·ψ): where it meets no current
  std::optional<Estimate> k_t_Nm_A;  // 3/2·p·ψ, where the log has the voltage of the supply
  std::optional<Estimate> R_ohm;     // of a phase, with the switch
};

/// Nothing where the drive never was at that limit, or at too few speeds.
std::optional<VoltageFit> fit_voltage(const Track& track);

}  // namespace lk::emulator
