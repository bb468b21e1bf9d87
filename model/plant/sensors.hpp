#pragma once

/// @file What the firmware gets to see in the fast tick (docs/model.md §7).

#include "model/measurement.hpp"
#include "model/noise.hpp"
#include "model/plant/plant_params.hpp"
#include "model/transforms.hpp"

namespace lk::model::inline LKEMU_ISA {

/// Counts of the encoder, unwrapped: floor of the magnet's angle as the chip sees it: late by its
/// latency, bent by its non-linearity (harmonics 1 and 2), and noisy.
template <class Real, class Noise>
inline Real encoder(const PlantParams<Real>& p, const Real& theta_m, const Real& omega_m, Noise& noise) {
  const Real seen = p.encoder_direction * (theta_m - omega_m * p.encoder_latency) + p.encoder_offset;
  Real bent = seen;
  if (any(p.inl_1 != 0.0) || any(p.inl_2 != 0.0)) {
    bent += p.inl_1 * sincos<Real>(seen + p.inl_1_phase).sin;
    bent += p.inl_2 * sincos<Real>(2.0 * seen + p.inl_2_phase).sin;
  }
  return floor<Real>((bent + p.encoder_noise * normal(noise)) * p.counts_per_rad);
}

/// One phase-current channel: amplifier, noise, ADC with its step and its ends.
template <class Real, class Noise>
inline Real current_channel(const PlantParams<Real>& p, const Real& i, const Real& gain,
                            const Real& offset, Noise& noise) {
  const Real amplified = gain * i + offset + p.current_noise * normal(noise);
  return clamp<Real>(round<Real>(amplified * p.inv_current_lsb) * p.current_lsb, -p.current_max,
                     p.current_max);
}

template <class Real, class Noise>
inline Measurement<Real> measure(const PlantParams<Real>& p, const Abc<Real>& i_abc, const Real& theta_m,
                                 const Real& omega_m, Noise& noise) {
  Measurement<Real> m;
  m.encoder_counts = encoder(p, theta_m, omega_m, noise);
  m.i_a = current_channel(p, i_abc.a, p.gain_a, p.offset_a, noise);
  m.i_b = current_channel(p, i_abc.b, p.gain_b, p.offset_b, noise);
  return m;
}

}  // namespace lk::model::inline LKEMU_ISA
