#include "model/plant/lane_faults.hpp"

#include "model/noise.hpp"
#include "model/rounding.hpp"

namespace lk::model {
namespace {

// An encoder chip without its magnet measures stray fields: noise around an angle that drifts
// within bounds. All three numbers are assumed.
constexpr double kLostNoise = 0.02;     // turns rms
constexpr double kLostWander = 0.0015;  // turns rms per sample
constexpr double kLostReturn = 1e-4;    // decay of the drift per sample: limits it to 0.1 turns rms

double encoder_shows(LaneFaults& f, double healthy) {
  switch (f.encoder) {
    case EncoderFault::kNone:
      return healthy;
    case EncoderFault::kStuck:
      return f.held_counts;
    case EncoderFault::kGarbage: {
      normal_deviate(f.noise);  // only to advance the generator, whose bits are used below
      const double share = static_cast<double>(f.noise >> 11U) * 0x1p-53;
      const double turn = floored(f.held_counts / f.counts_per_turn);
      return floored((turn + share) * f.counts_per_turn);
    }
    case EncoderFault::kLostMagnet:
      f.wander +=
          f.counts_per_turn * kLostWander * normal_deviate(f.noise) - kLostReturn * f.wander;
      return floored(f.held_counts + f.wander +
                     f.counts_per_turn * kLostNoise * normal_deviate(f.noise));
  }
  return healthy;
}

}  // namespace

Measurement<double> falsified(LaneFaults& faults, const Measurement<double>& healthy) {
  return {encoder_shows(faults, healthy.encoder_counts), faults.i_a.value_or(healthy.i_a),
          faults.i_b.value_or(healthy.i_b)};
}

}  // namespace lk::model
