#pragma once

/// @file Faults of one drive that no plant parameter can express (docs/internals/model.md §14).
/// Only a tick with kFaultyParts reads them, one drive after the other.

#include "model/faults.hpp"
#include "model/measurement.hpp"
#include "model/real.hpp"
#include "model/stored_real.hpp"

namespace lk::model {

struct LaneFaults {
  EncoderFault encoder = EncoderFault::kNone;
  double held_counts = 0;          // reading of the encoder when the fault began
  double counts_per_turn = 1;      // counts
  double wander = 0;               // counts, drift of an encoder without its magnet
  std::uint64_t noise = 1;         // generator for these faults only; the sensors have another
  std::optional<double> i_a, i_b;  // A, readings of stuck channels
  bool bridge_dead = false;
  std::array<LegFault, 3> legs{};

  bool leg_broken() const { return legs != std::array<LegFault, 3>{}; }
  bool any() const {
    return encoder != EncoderFault::kNone || i_a || i_b || bridge_dead || leg_broken();
  }
};

/// Returns the measurement with these faults.
Measurement<double> falsified(LaneFaults& faults, const Measurement<double>& healthy);

inline namespace LKEMU_ISA {

/// Applies the faults to the measurements and bridge states of the drives in a `Real`.
template <class Real>
inline void falsify(LaneFaults* faults, Measurement<Real>& m, Real& bridge) {
  for (std::size_t n = 0; n < kSizeOf<Real>; ++n) {
    if (!faults[n].any()) {
      continue;
    }
    const Measurement<double> shown = falsified(
        faults[n], {get_lane(m.encoder_counts, n), get_lane(m.i_a, n), get_lane(m.i_b, n)});
    set_lane(m.encoder_counts, n, shown.encoder_counts);
    set_lane(m.i_a, n, shown.i_a);
    set_lane(m.i_b, n, shown.i_b);
    if (faults[n].bridge_dead) {
      set_lane(bridge, n, 0.0);
    }
  }
}

}  // namespace LKEMU_ISA
}  // namespace lk::model
