#pragma once

/// @file Sensors that the firmware reads in the fast tick (docs/internals/model.md §7).

#include "model/measurement.hpp"
#include "model/noise.hpp"
#include "model/plant/plant_params.hpp"
#include "model/rounding.hpp"
#include "model/stored_real.hpp"
#include "model/transforms.hpp"

namespace lk::model {
inline namespace LKEMU_ISA {

/// Returns the encoder chip's error at the magnet angle θ = `seen`, rad:
/// a₁·sin θ + b₁·cos θ + a₂·sin 2θ + b₂·cos 2θ.
template <class Real>
inline Real non_linearity(const PlantParams<Real>& p, const Real& seen) {
  const SinCos<Real> t = sincos(seen);
  return t.sin * (p.inl_sin + 2.0 * (p.inl_sin_2 * t.cos - p.inl_cos_2 * t.sin)) +
         t.cos * p.inl_cos + p.inl_cos_2;
}

/// Returns the encoder's counts, unwrapped: the floor of the magnet's angle in counts, with
/// latency, non-linearity and noise.
template <class Real>
inline Real encoder(const PlantParams<Real>& p, const Real& theta_m, const Real& omega_m,
                    WordsOf<Real>& noise) {
  const Real seen =
      p.encoder_direction * (theta_m - omega_m * p.encoder_latency) + p.encoder_offset;
  return floored((seen + non_linearity(p, seen) + p.encoder_noise * normal_deviate(noise)) *
                 p.counts_per_rad);
}

/// Returns the reading of a phase-current channel, A, after amplifier, noise and ADC.
template <class Real>
inline Real current_channel(const PlantParams<Real>& p, const Real& i, const Real& gain,
                            const Real& offset, WordsOf<Real>& noise) {
  const Real amplified = gain * i + offset + p.current_noise * normal_deviate(noise);
  return clamp(nearest(amplified * p.inv_current_lsb) * p.current_lsb, -p.current_max,
               p.current_max);
}

template <class Real>
inline Measurement<Real> measure(const PlantParams<Real>& p, const Abc<Real>& i_abc,
                                 const Real& theta_m, const Real& omega_m, WordsOf<Real>& noise) {
  Measurement<Real> m;
  m.encoder_counts = encoder(p, theta_m, omega_m, noise);
  m.i_a = current_channel(p, i_abc.a, p.gain_a, p.offset_a, noise);
  m.i_b = current_channel(p, i_abc.b, p.gain_b, p.offset_b, noise);
  return m;
}

}  // namespace LKEMU_ISA
}  // namespace lk::model
