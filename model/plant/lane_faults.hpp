#pragma once

/// @file What is broken about one drive of a block that no number of its plant can say
/// (docs/model.md §14). The tick looks here only where it has every part, drive by drive.

#include "model/faults.hpp"
#include "model/measurement.hpp"
#include "model/real.hpp"
#include "model/stored_real.hpp"

namespace lk::model {

struct LaneFaults {
  EncoderFault encoder = EncoderFault::kNone;
  double held_counts = 0;          // what the encoder showed when the fault began
  double counts_per_turn = 1;      // counts
  double wander = 0;               // counts, of an encoder that has lost its magnet
  std::uint64_t noise = 1;         // of these faults alone: the sensors' own goes on undisturbed
  std::optional<double> i_a, i_b;  // A, as a stuck converter shows them
  bool bridge_dead = false;
  std::array<LegFault, 3> legs{};

  bool leg_broken() const { return legs != std::array<LegFault, 3>{}; }
  bool any() const {
    return encoder != EncoderFault::kNone || i_a || i_b || bridge_dead || leg_broken();
  }
};

/// What a drive with these faults gets to see instead of `healthy`.
Measurement<double> falsified(LaneFaults& faults, const Measurement<double>& healthy);

inline namespace LKEMU_ISA {

/// The measurements, and whether the bridge acts, of the drives of a `Real`, with their faults.
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
